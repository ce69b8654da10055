// Frames that different masters build in different ways, byte by byte.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "tests/sim/bus_hand_master.h"

namespace sim::bus::test {
namespace bus_passing_frame_test {

constexpr std::uint8_t kBrd = 7;
constexpr std::uint8_t kBwr = 8;
constexpr std::uint8_t kUnknownCommand = 0x5A;
constexpr std::size_t kHeaderLength = 14;  // offset of the EtherCAT header's two bytes
constexpr std::size_t kFirstDatagram = 16;

/// One datagram: command, index, address (broadcast, register), length with the bit that more follow,
/// interrupt, data, working counter.
Bytes datagram(std::uint8_t command, std::uint16_t offset, const Bytes& data, bool more = false) {
  const auto length = static_cast<std::uint16_t>(data.size() | (more ? 0x8000U : 0U));
  Bytes bytes{command,
              0x11,
              0,
              0,
              static_cast<std::uint8_t>(offset),
              static_cast<std::uint8_t>(offset >> 8),
              static_cast<std::uint8_t>(length),
              static_cast<std::uint8_t>(length >> 8),
              0,
              0};
  bytes.insert(bytes.end(), data.begin(), data.end());
  bytes.insert(bytes.end(), {0, 0});
  return bytes;
}

/// A frame whose EtherCAT header says that `length` bytes of datagrams follow.
Bytes frame_of(std::initializer_list<Bytes> datagrams, std::size_t length, std::uint8_t type = 1) {
  Bytes frame(12, 0xFF);
  frame.insert(frame.end(), {0x88, 0xA4, static_cast<std::uint8_t>(length),
                             static_cast<std::uint8_t>(type << 4 | (length >> 8 & 0x07))});
  for (const Bytes& each : datagrams) frame.insert(frame.end(), each.begin(), each.end());
  return frame;
}

Bytes padded(Bytes frame) {
  frame.resize(std::max<std::size_t>(frame.size(), 60));
  return frame;
}

class PassingFrames : public ::testing::Test {
 protected:
  std::uint16_t station_of(std::size_t slave) {
    return bus.slave(slave).controller().get<std::uint16_t>(reg::kStationAddress);
  }
  std::uint8_t processing_errors(std::size_t slave) {
    return bus.slave(slave).controller().get<std::uint8_t>(reg::kProcessingErrorCounter);
  }
  /// The working counter of the datagram that begins `at`, with `bytes` of data.
  static std::uint16_t counter(const Bytes& frame, std::size_t at, std::size_t bytes) {
    return static_cast<std::uint16_t>(frame[at + 10 + bytes] | frame[at + 11 + bytes] << 8);
  }
  PassingFrames() {
    for (int i = 0; i < 3; ++i) bus.add(drive());
  }
  EmulatedBus bus;
};

TEST_F(PassingFrames, TheHeadersLengthIsIgnored) {
  // Too short, too long, none, and longer than the frame; 13 is correct.
  for (const std::size_t length : {13U, 0U, 1U, 12U, 14U, 40U, 44U, 45U, 0x7FFU}) {
    Bytes frame = padded(frame_of({datagram(kBrd, reg::kType, {0})}, length));
    ASSERT_TRUE(bus.process(frame)) << length;
    EXPECT_EQ(frame[kFirstDatagram + 10], 0x11) << length << ": an ET1100";
    EXPECT_EQ(counter(frame, kFirstDatagram, 1), 3) << length;
    EXPECT_EQ(frame[kHeaderLength], length & 0xFF) << "it comes back as it went";
  }
  for (std::size_t slave = 0; slave < bus.size(); ++slave) EXPECT_EQ(processing_errors(slave), 0);
}

TEST_F(PassingFrames, ALengthThatCoversOnlyTheFirstDatagramHidesNoOther) {
  Bytes frame =
      frame_of({datagram(kBrd, reg::kType, {0}, true), datagram(kBwr, reg::kStationAddress, {7, 0})}, 13);
  ASSERT_TRUE(bus.process(frame));
  EXPECT_EQ(counter(frame, kFirstDatagram + 13, 2), 3);
  for (std::size_t slave = 0; slave < bus.size(); ++slave) EXPECT_EQ(station_of(slave), 7);
}

TEST_F(PassingFrames, WhatIsBehindTheLastDatagramIsNoDatagram) {
  // Without the bit that more follow, bytes behind are padding whatever they look like.
  Bytes frame = frame_of({datagram(kBrd, reg::kType, {0}), datagram(kBwr, reg::kStationAddress, {7, 0})}, 27);
  ASSERT_TRUE(bus.process(frame));
  EXPECT_EQ(counter(frame, kFirstDatagram, 1), 3);
  EXPECT_EQ(counter(frame, kFirstDatagram + 13, 2), 0);
  EXPECT_EQ(station_of(0), 0);
}

TEST_F(PassingFrames, AnUnknownCommandDoesNothingAndTheNextIsProcessed) {
  Bytes frame = frame_of({datagram(kUnknownCommand, reg::kStationAddress, {9, 0}, true),
                          datagram(kBwr, reg::kStationAddress, {7, 0})},
                         28);
  ASSERT_TRUE(bus.process(frame));
  EXPECT_EQ(counter(frame, kFirstDatagram, 2), 0);
  EXPECT_EQ(counter(frame, kFirstDatagram + 14, 2), 3);
  EXPECT_EQ(station_of(0), 7);
}

TEST_F(PassingFrames, AVlanTagIsPassedOver) {
  Bytes frame = frame_of({datagram(kBrd, reg::kType, {0})}, 13);
  frame.insert(frame.begin() + 12, {0x81, 0x00, 0x60, 0x05});
  ASSERT_TRUE(bus.process(frame));
  EXPECT_EQ(counter(frame, kFirstDatagram + 4, 1), 3);
  EXPECT_EQ(frame[12], 0x81) << "the tag stays";
}

TEST_F(PassingFrames, AFrameThatEndsInADatagramWritesNoRegisterAndIsCounted) {
  const Bytes whole = datagram(kBwr, reg::kStationAddress, {7, 0}, true);
  const Bytes cut = datagram(kBwr, reg::kStationAlias, {8, 0});
  const Bytes frame = frame_of({whole, cut}, 28);
  // Cut within the second one's header, data and counter, and before it.
  for (std::size_t missing = 1; missing <= cut.size(); ++missing) {
    Bytes shorter(frame.begin(), frame.end() - static_cast<std::ptrdiff_t>(missing));
    EXPECT_FALSE(bus.process(shorter)) << missing;
    EXPECT_EQ(counter(shorter, kFirstDatagram, 2), 3) << "the first one was processed as it passed";
    EXPECT_EQ(station_of(0), 0) << "but a damaged frame writes no register";
    EXPECT_EQ(processing_errors(0), missing);
  }
}

TEST_F(PassingFrames, OnlyEthercatOfTypeOneIsProcessed) {
  for (const auto type : std::to_array<std::uint8_t>({0, 4, 5})) {  // 4: network variables, 5: mailboxes
    Bytes frame = padded(frame_of({datagram(kBwr, reg::kStationAddress, {7, 0})}, 14, type));
    EXPECT_FALSE(bus.process(frame));
    EXPECT_EQ(counter(frame, kFirstDatagram, 2), 0);
  }
  Bytes other = padded(frame_of({datagram(kBwr, reg::kStationAddress, {7, 0})}, 14));
  other[12] = 0x08;
  other[13] = 0x06;  // ARP
  EXPECT_FALSE(bus.process(other));
  EXPECT_EQ(station_of(0), 0);
}

}  // namespace bus_passing_frame_test
}  // namespace sim::bus::test
