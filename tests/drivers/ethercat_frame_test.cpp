// Frames against bytes calculated by hand from ETG.1000.4, section 5.
#include "drivers/ethercat/frame.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "tests/drivers/ethercat_fakes.h"

namespace drivers::ethercat::test {
namespace ethercat_frame_test {

// Parses an exact copy on the heap, so that the address sanitizer sees any access beyond its end, and walks
// it. All datagrams must lie inside; returns how many there were.
int walk(std::span<const std::uint8_t> frame, FrameError* error = nullptr) {
  const auto copy = std::make_unique<std::uint8_t[]>(frame.size());
  std::copy(frame.begin(), frame.end(), copy.get());
  const std::uint8_t* const begin = copy.get();
  const std::uint8_t* const end = begin + frame.size();
  FrameReader reader;
  const FrameError found = reader.parse({copy.get(), frame.size()});
  if (error != nullptr) *error = found;
  Datagram datagram;
  int count = 0;
  while (reader.next(datagram)) {
    ++count;
    EXPECT_EQ(found, FrameError::kNone);
    EXPECT_GE(datagram.header, begin);
    EXPECT_LE(datagram.counter + kCounterBytes, end);
    EXPECT_EQ(datagram.data.data() + datagram.data.size(), datagram.counter);
    EXPECT_LE(static_cast<int>(datagram.command), int{kHighestCommand});
    (void)datagram.working_counter();
  }
  return count;
}

Bytes bytes_of(FrameWriter& writer) {
  const std::span<const std::uint8_t> bytes = writer.bytes();
  return {bytes.begin(), bytes.end()};
}

Bytes three_datagrams() {
  FrameWriter writer;
  const Datagram first = writer.add(Command::kFpwr, 7, address_of(0x1001, 0x0120), 2);
  first.data[0] = 8;
  writer.add(Command::kLrw, 7, 0x00010000, 40);
  writer.add(Command::kBrd, 7, address_of(0, 0x0130), 6);
  return bytes_of(writer);
}

TEST(Frame, OneDatagramIsTheStandardsBytesPaddedTo60) {
  FrameWriter writer;
  writer.add(Command::kBrd, 0x2A, address_of(0, 0x0130), 2);
  Bytes expected{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF,  // to everybody
                 0x10, 0x10, 0x10, 0x10, 0x10, 0x10,  // from a locally chosen address
                 0x88, 0xA4,                          // EtherType, big-endian
                 0x0E, 0x10,                          // 14 bytes follow, type 1 in bits 12 to 15
                 0x07, 0x2A,                          // BRD, index
                 0x00, 0x00, 0x30, 0x01,              // ADP 0, ADO 0x0130
                 0x02, 0x00,                          // 2 bytes, nothing follows
                 0x00, 0x00,                          // interrupt
                 0x00, 0x00,                          // data
                 0x00, 0x00};                         // working counter
  expected.resize(60, 0);
  EXPECT_EQ(bytes_of(writer), expected);
}

TEST(Frame, AllButTheLastDatagramSayThatMoreFollows) {
  FrameWriter writer;
  const Datagram write = writer.add(Command::kFpwr, 3, address_of(0x1005, 0x0800), 8);
  for (std::size_t i = 0; i < 8; ++i) write.data[i] = static_cast<std::uint8_t>(0xA0 + i);
  writer.add(Command::kLrw, 3, 0x12345678, 1);
  writer.add(Command::kAprd, 3, address_of(position_address(2), 0x0010), 2);
  const Bytes frame = bytes_of(writer);
  const Bytes expected{
      0x2F, 0x10,                                                                    // 20 + 13 + 14 bytes
      0x05, 0x03, 0x05, 0x10, 0x00, 0x08, 0x08, 0x80, 0x00, 0x00,                    // FPWR, more
      0xA0, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0x00, 0x00,                    //
      0x0C, 0x03, 0x78, 0x56, 0x34, 0x12, 0x01, 0x80, 0x00, 0x00, 0x00, 0x00, 0x00,  // LRW, more
      0x01, 0x03, 0xFE, 0xFF, 0x10, 0x00, 0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00};
  EXPECT_EQ(Bytes(frame.begin() + 14, frame.end()), expected) << "63 bytes: no padding";
}

TEST(Frame, EveryCommandHasItsNumber) {
  const std::array<Command, 15> order{Command::kNop,  Command::kAprd, Command::kApwr, Command::kAprw,
                                      Command::kFprd, Command::kFpwr, Command::kFprw, Command::kBrd,
                                      Command::kBwr,  Command::kBrw,  Command::kLrd,  Command::kLwr,
                                      Command::kLrw,  Command::kArmw, Command::kFrmw};
  for (std::size_t i = 0; i < order.size(); ++i) {
    FrameWriter writer;
    writer.add(order[i], 0, 0, 0);
    EXPECT_EQ(writer.bytes()[16], i);
  }
}

TEST(Frame, APositionIsCountedUpToZeroOnItsWay) {
  EXPECT_EQ(position_address(0), 0);
  EXPECT_EQ(position_address(1), 0xFFFF);
  EXPECT_EQ(position_address(10), 0xFFF6);
}

TEST(Frame, AFullOneHas1514Bytes) {
  FrameWriter writer;
  EXPECT_TRUE(writer.empty());
  EXPECT_EQ(writer.free_bytes(), 1486U) << "1500 - 2 - 12";
  EXPECT_EQ(writer.add(Command::kLrw, 0, 0, 1487).counter, nullptr);
  EXPECT_TRUE(writer.empty());
  ASSERT_NE(writer.add(Command::kLrw, 0, 0, 1486).counter, nullptr);
  EXPECT_EQ(writer.free_bytes(), 0U);
  EXPECT_EQ(writer.add(Command::kNop, 0, 0, 0).counter, nullptr) << "not even its header fits";
  EXPECT_EQ(writer.bytes().size(), kMaxFrameBytes);
  EXPECT_EQ(walk(writer.bytes()), 1);
}

TEST(Frame, AnEmptyDatagramFitsExactlyBehindOthers) {
  FrameWriter writer;
  writer.add(Command::kLrw, 0, 0, 1486 - kDatagramOverheadBytes);
  EXPECT_EQ(writer.free_bytes(), 0U);
  EXPECT_NE(writer.add(Command::kNop, 0, 0, 0).counter, nullptr);
  EXPECT_EQ(writer.bytes().size(), kMaxFrameBytes);
  EXPECT_EQ(walk(writer.bytes()), 2);
}

TEST(Frame, TheNextFrameKeepsNothingOfTheLast) {
  FrameWriter writer;
  const Datagram datagram = writer.add(Command::kLrw, 1, 0, 200);
  std::fill(datagram.data.begin(), datagram.data.end(), std::uint8_t{0xEE});
  (void)writer.bytes();
  writer.clear();
  writer.add(Command::kBrd, 2, 0, 1);
  const Bytes frame = bytes_of(writer);
  EXPECT_EQ(frame.size(), 60U);
  EXPECT_EQ(std::count(frame.begin(), frame.end(), 0xEE), 0);
}

TEST(Frame, WhatIsWrittenIsRead) {
  Bytes frame = three_datagrams();
  FrameReader reader;
  ASSERT_EQ(reader.parse(frame), FrameError::kNone);
  Datagram datagram;
  ASSERT_TRUE(reader.next(datagram));
  EXPECT_EQ(datagram.command, Command::kFpwr);
  EXPECT_EQ(datagram.index, 7);
  EXPECT_EQ(datagram.slave(), 0x1001);
  EXPECT_EQ(datagram.offset(), 0x0120);
  EXPECT_EQ(datagram.data.size(), 2U);
  EXPECT_EQ(datagram.data[0], 8);
  ASSERT_TRUE(reader.next(datagram));
  EXPECT_EQ(datagram.address, 0x00010000U);
  datagram.counter[0] = 0x34;
  datagram.counter[1] = 0x12;
  EXPECT_EQ(datagram.working_counter(), 0x1234);
  ASSERT_TRUE(reader.next(datagram));
  EXPECT_EQ(datagram.data.size(), 6U);
  EXPECT_FALSE(reader.next(datagram));
}

TEST(Frame, EveryPrefixIsRefusedButTheWholeAndItsPadding) {
  const Bytes frame = three_datagrams();
  const std::size_t whole = kFrameHeaderBytes + 14 + 52 + 18;
  ASSERT_EQ(frame.size(), whole);
  for (std::size_t size = 0; size < whole; ++size) {
    FrameError error = FrameError::kNone;
    EXPECT_EQ(walk(std::span(frame).first(size), &error), 0) << size;
    EXPECT_EQ(error, size < kFrameHeaderBytes ? FrameError::kTooShort : FrameError::kTruncated) << size;
  }
  Bytes padded = frame;
  padded.resize(whole + 5);
  EXPECT_EQ(walk(padded), 3);
}

TEST(Frame, EachFaultHasItsName) {
  const auto error_after = [](std::size_t at, std::uint8_t value) {
    Bytes frame = three_datagrams();
    frame[at] = value;
    FrameError error = FrameError::kNone;
    walk(frame, &error);
    return error;
  };
  EXPECT_EQ(error_after(13, 0xA5), FrameError::kNotEthercat);
  EXPECT_EQ(error_after(15, 0x40), FrameError::kNotDatagrams);
  EXPECT_EQ(error_after(14, 0xFF), FrameError::kTruncated) << "longer than what came";
  EXPECT_EQ(error_after(14, 0x0E), FrameError::kTruncated) << "ends after the first, which says more follows";
  EXPECT_EQ(error_after(88, 0x07), FrameError::kTruncated) << "the last is longer than the frame says";
  EXPECT_EQ(error_after(16, 15), FrameError::kUnknownCommand);
  EXPECT_EQ(error_after(23, 0x00), FrameError::kLengthMismatch) << "the first says nothing follows";
  EXPECT_STREQ(describe(FrameError::kTruncated), "a length points beyond its end");
}

TEST(Frame, SeededMutationsNeverLeaveTheBuffer) {
  std::mt19937 random(20240817);
  const Bytes original = three_datagrams();
  int accepted = 0;
  for (int run = 0; run < 20'000; ++run) {
    Bytes frame = original;
    for (auto changes = 1 + random() % 4; changes > 0; --changes)
      frame[12 + random() % (frame.size() - 12)] = static_cast<std::uint8_t>(random());
    if (random() % 3 == 0) frame.resize(random() % frame.size());
    accepted += walk(frame) > 0 ? 1 : 0;
  }
  // Changed data bytes leave a frame valid: the test would be idle if all or none were accepted.
  EXPECT_GT(accepted, 1000);
  EXPECT_LT(accepted, 19'000);
}

TEST(Frame, NumbersAreLittleEndian) {
  std::array<std::uint8_t, 4> bytes{};
  store_le(bytes.data(), std::int32_t{-2});
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 4>{0xFE, 0xFF, 0xFF, 0xFF}));
  EXPECT_EQ(load_le<std::int32_t>(bytes.data()), -2);
  EXPECT_EQ(load_le<std::uint16_t>(bytes.data()), 0xFFFE);
}

}  // namespace ethercat_frame_test
}  // namespace drivers::ethercat::test
