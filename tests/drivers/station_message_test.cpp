// The bytes of the link's messages, and what no station sends.
#include "drivers/station/message.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

namespace station_message_test {

using namespace drivers::station;
using drivers::haptic::HapticFault;

HandleMessage handle_message() {
  HandleMessage message;
  message.link = {.sent_ns = 0x0102030405060708,
                  .echo_ns = 5,
                  .echo_held_us = 700,
                  .lost_permille = 50,
                  .energy_in_nJ = 1'000'000,
                  .enable = true,
                  .released = true,
                  .fault = HapticFault::kNotReady,
                  .detail = 9};
  message.count = 2;
  message.states[0] = {.age_us = 100,
                       .position_nm = {-1, 2'000'000, 3},
                       .rotation_q30 = {0, 1 << 30, 0, 0},
                       .buttons = 3,
                       .force_uN = {4, -5, 6}};
  message.states[1] = {.position_nm = {7, 8, 9}};
  return message;
}

std::vector<std::uint8_t> bytes_of(const HandleMessage& message) {
  std::vector<std::uint8_t> bytes(kMaxMessageBytes);
  bytes.resize(encode(message, bytes));
  return bytes;
}

TEST(StationMessage, IsLittleEndianInTheDocumentedOrder) {
  const std::vector<std::uint8_t> bytes = bytes_of(handle_message());
  ASSERT_EQ(bytes.size(), 37U + 1 + 2 * 48);
  EXPECT_EQ(std::vector(bytes.begin(), bytes.begin() + 8),
            (std::vector<std::uint8_t>{8, 7, 6, 5, 4, 3, 2, 1}));
  EXPECT_EQ(bytes[8], 5);                      // echo
  EXPECT_EQ(bytes[16] | bytes[17] << 8, 700);  // held
  EXPECT_EQ(bytes[20], 50);                    // lost
  EXPECT_EQ(bytes[22] | bytes[23] << 8 | bytes[24] << 16, 1'000'000);
  EXPECT_EQ(bytes[30], 1);     // enable
  EXPECT_EQ(bytes[31], 1);     // released
  EXPECT_EQ(bytes[32], 2);     // fault
  EXPECT_EQ(bytes[33], 9);     // detail
  EXPECT_EQ(bytes[37], 2);     // states
  EXPECT_EQ(bytes[38], 100);   // age of the newest
  EXPECT_EQ(bytes[42], 0xFF);  // its position, -1 nm
  EXPECT_EQ(bytes[45], 0xFF);
}

TEST(StationMessage, ComesBackAsItWas) {
  const HandleMessage message = handle_message();
  HandleMessage read;
  ASSERT_TRUE(decode(bytes_of(message), read));
  EXPECT_EQ(read.link, message.link);
  EXPECT_EQ(read.count, 2);
  EXPECT_EQ(read.states[0], message.states[0]);
  EXPECT_EQ(read.states[1], message.states[1]);

  ForceMessage force;
  force.count = kMaxRepeated + 1;
  force.states[kMaxRepeated].force_uN = {-8'000'000, 0, 1};
  std::array<std::uint8_t, kMaxMessageBytes> bytes{};
  const std::size_t size = encode(force, bytes);
  ASSERT_GT(size, 0U);
  ForceMessage force_read;
  ASSERT_TRUE(decode(std::span(bytes).first(size), force_read));
  EXPECT_EQ(force_read, force);
}

TEST(StationMessage, EveryOtherLengthIsRefused) {
  std::vector<std::uint8_t> bytes = bytes_of(handle_message());
  HandleMessage read;
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(decode(std::span(bytes).first(size), read)) << size;
  bytes.push_back(0);
  EXPECT_FALSE(decode(bytes, read));
}

TEST(StationMessage, ValuesThatNoStationSendsAreRefused) {
  const std::vector<std::uint8_t> good = bytes_of(handle_message());
  HandleMessage read;
  const auto with = [&](std::size_t at, std::uint8_t value) {
    std::vector<std::uint8_t> bytes = good;
    bytes[at] = value;
    return decode(bytes, read);
  };
  EXPECT_TRUE(with(30, 0));
  EXPECT_FALSE(with(30, 2)) << "neither enabled nor not";
  EXPECT_FALSE(with(31, 2)) << "neither released nor not";
  EXPECT_FALSE(with(32, 13)) << "a fault that no device has";
  EXPECT_FALSE(with(21, 4)) << "more than everything lost";
  EXPECT_FALSE(with(7, 0x80)) << "sent before the clock's origin";
  EXPECT_FALSE(with(7, 0x41)) << "sent more than 2^62 ns after it";
  EXPECT_FALSE(with(15, 0x80)) << "an answer to a message from before the clock's origin";
  EXPECT_FALSE(with(15, 0x41)) << "an answer to a message from more than 2^62 ns after it";
  EXPECT_FALSE(with(29, 0x80)) << "an energy below zero, which only grows from there";
  EXPECT_FALSE(with(37, 0)) << "no state";
  EXPECT_FALSE(with(37, kMaxRepeated + 2)) << "more states than a message has";
  EXPECT_FALSE(with(38 + 4 + 12 + 7, 0x20)) << "a rotation that is half as long";
}

TEST(StationMessage, ABufferThatIsTooSmallStaysEmpty) {
  std::vector<std::uint8_t> bytes(37 + 1 + 2 * 48 - 1);
  EXPECT_EQ(encode(handle_message(), bytes), 0U);
}

}  // namespace station_message_test
