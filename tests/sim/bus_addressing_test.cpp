// Addressing, working counters and registers according to ETG.1000.4.
#include <gtest/gtest.h>

#include "tests/sim/bus_hand_master.h"

namespace sim::bus::test {
namespace bus_addressing_test {

class ThreeDrives : public ::testing::Test {
 protected:
  ThreeDrives() {
    for (int i = 0; i < 3; ++i) bus.add(drive());
  }
  EmulatedBus bus;
  HandMaster master{bus};
};

TEST_F(ThreeDrives, BroadcastReadByHandCountsThemAndMarksTheSender) {
  Bytes frame(60);
  const Bytes sent{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x88, 0xA4,  //
                   0x0D, 0x10,                                      // 13 bytes of datagrams
                   0x07, 0x42, 0x00, 0x00, 0x00, 0x00, 0x01, 0x00,  // BRD, index, position 0, type, 1 byte
                   0x00, 0x00, 0x00, 0x00, 0x00};                   // interrupt, data, counter
  std::ranges::copy(sent, frame.begin());
  Bytes expected = frame;
  expected[6] = 0x12;   // locally administered
  expected[18] = 0x03;  // counted up by each
  expected[26] = 0x11;  // ET1100
  expected[27] = 0x03;  // working counter
  ASSERT_TRUE(bus.process(frame));
  EXPECT_EQ(frame, expected);
}

TEST_F(ThreeDrives, EachAnswersAtItsPosition) {
  for (std::size_t i = 0; i < 3; ++i) master.write(i, reg::kStationAddress, 0x1001 + i, 2);
  for (std::size_t i = 0; i < 3; ++i) {
    const Answer answer = master.run(Command::kAprd, HandMaster::position(i), reg::kStationAddress, Bytes(2));
    EXPECT_EQ(answer.counter, 1);
    EXPECT_EQ(answer.number(), 0x1001 + i);
    EXPECT_EQ(answer.slave, static_cast<std::uint16_t>(3 - i));
  }
  EXPECT_EQ(master.run(Command::kAprd, HandMaster::position(3), reg::kType, Bytes(1)).counter, 0);
}

TEST_F(ThreeDrives, EachAnswersAtItsStationAddress) {
  master.configure();
  const Answer answer = master.run(Command::kFprd, kStation + 1, reg::kStationAddress, Bytes(2));
  EXPECT_EQ(answer.counter, 1);
  EXPECT_EQ(answer.data, (Bytes{0x02, 0x10}));
  EXPECT_EQ(answer.slave, kStation + 1) << "a station address is not counted up";
  EXPECT_EQ(master.run(Command::kFprd, 0x1004, reg::kStationAddress, Bytes(2)).counter, 0);
}

TEST_F(ThreeDrives, WorkingCounterPerCommand) {
  master.configure();
  const std::uint16_t memory = 0x1800;  // plain memory
  EXPECT_EQ(master.run(Command::kNop, 0, memory, Bytes(2)).counter, 0);
  EXPECT_EQ(master.run(Command::kAprd, 0, memory, Bytes(2)).counter, 1);
  EXPECT_EQ(master.run(Command::kApwr, 0, memory, Bytes(2)).counter, 1);
  EXPECT_EQ(master.run(Command::kAprw, 0, memory, Bytes(2)).counter, 3);
  EXPECT_EQ(master.run(Command::kFprd, kStation, memory, Bytes(2)).counter, 1);
  EXPECT_EQ(master.run(Command::kFpwr, kStation, memory, Bytes(2)).counter, 1);
  EXPECT_EQ(master.run(Command::kFprw, kStation, memory, Bytes(2)).counter, 3);
  EXPECT_EQ(master.run(Command::kBrd, 0, memory, Bytes(2)).counter, 3);
  EXPECT_EQ(master.run(Command::kBwr, 0, memory, Bytes(2)).counter, 3);
  EXPECT_EQ(master.run(Command::kBrw, 0, memory, Bytes(2)).counter, 9);
  EXPECT_EQ(master.run(Command::kArmw, 0, memory, Bytes(2)).counter, 3);
  EXPECT_EQ(master.run(Command::kFrmw, kStation, memory, Bytes(2)).counter, 3);
}

TEST_F(ThreeDrives, ReadWriteExchangesWhatWasThereForWhatCame) {
  master.write(0, 0x1800, {0x11, 0x22});
  EXPECT_EQ(master.run(Command::kAprw, 0, 0x1800, {0xAA, 0xBB}).data, (Bytes{0x11, 0x22}));
  EXPECT_EQ(master.read(0, 0x1800, 2).data, (Bytes{0xAA, 0xBB}));
}

TEST_F(ThreeDrives, BroadcastReadIsTheOrOfAllAndOfWhatCame) {
  master.write(0, 0x1800, {0x01});
  master.write(1, 0x1800, {0x02});
  master.write(2, 0x1800, {0x08});
  EXPECT_EQ(master.run(Command::kBrd, 0, 0x1800, {0x40}).data, (Bytes{0x4B}));
}

TEST_F(ThreeDrives, ReadMultipleWriteTakesFromOneAndGivesToTheOthers) {
  master.configure();
  master.write(1, 0x1800, {0x77, 0x66});
  const Answer answer = master.run(Command::kFrmw, kStation + 1, 0x1800, {0x00, 0x00});
  EXPECT_EQ(answer.counter, 3);
  EXPECT_EQ(master.read(0, 0x1800, 2).data, (Bytes{0x00, 0x00})) << "in front of the reader";
  EXPECT_EQ(master.read(2, 0x1800, 2).data, (Bytes{0x77, 0x66}));
  EXPECT_EQ(master.run(Command::kArmw, HandMaster::position(1), 0x1800, {0x00, 0x00}).data,
            (Bytes{0x77, 0x66}));
}

TEST_F(ThreeDrives, AliasAnswersOnlyWhenEnabled) {
  EmulatedBus other;
  SlaveDescription description = drive();
  description.station_alias = 0x0321;
  other.add(description);
  HandMaster hand(other);
  EXPECT_EQ(hand.run(Command::kFprd, 0x0321, reg::kType, Bytes(1)).counter, 0);
  hand.write(0, reg::kDlControl + 3, 0x01, 1);
  EXPECT_EQ(hand.run(Command::kFprd, 0x0321, reg::kType, Bytes(1)).counter, 1);
}

TEST_F(ThreeDrives, ReportsItsFeatures) {
  EXPECT_EQ(master.read(0, reg::kFmmuCount, 5).data, (Bytes{8, 8, 8, 0x0F, 0x0C}));
  EXPECT_EQ(master.read(0, reg::kWatchdogDivider, 2).number(), 2498U);
  EXPECT_EQ(master.read(0, reg::kWatchdogProcessData, 2).number(), 1000U);
}

TEST_F(ThreeDrives, ReadOnlyRegistersStayAndCountAsWritten) {
  EXPECT_EQ(master.write(0, reg::kType, {0x99}).counter, 1);
  EXPECT_EQ(master.read(0, reg::kType, 1).number(), 0x11U);
  EXPECT_EQ(master.write(0, reg::kAlStatus, {0x08}).counter, 1);
  EXPECT_EQ(master.al_status(0), 0x0001);
}

TEST_F(ThreeDrives, RegistersChangeAtTheEndOfTheFrameMemoryAtOnce) {
  const auto at = [](std::uint16_t offset) { return drivers::ethercat::address_of(0, offset); };
  const std::vector<Answer> answers =
      master.run(HandFrame()
                     .add(Command::kApwr, at(reg::kStationAddress), {0x34, 0x12})
                     .add(Command::kAprd, at(reg::kStationAddress), Bytes(2))
                     .add(Command::kApwr, at(0x0F7F), {0x44, 0x55})
                     .add(Command::kAprd, at(0x0F80), Bytes(1))
                     .add(Command::kApwr, at(0x1800), {0x66})
                     .add(Command::kAprd, at(0x1800), Bytes(1)));
  EXPECT_EQ(answers[1].data, (Bytes{0x00, 0x00}));
  EXPECT_EQ(answers[3].data, (Bytes{0x55}));
  EXPECT_EQ(answers[5].data, (Bytes{0x66}));
  EXPECT_EQ(master.read(0, reg::kStationAddress, 2).number(), 0x1234U);
}

TEST_F(ThreeDrives, BeyondTheMemoryNothingCounts) {
  EXPECT_EQ(master.read(0, 0x2FFF, 1).counter, 1);
  EXPECT_EQ(master.read(0, 0x3000, 4).counter, 0);
  EXPECT_EQ(master.write(0, 0x3000, Bytes(4)).counter, 0);
  EXPECT_EQ(master.read(0, 0x2FFE, 4).counter, 1) << "one byte is enough";
  EXPECT_EQ(master.read(0, 0xFFFF, 8).counter, 0);
}

TEST_F(ThreeDrives, EventsShowInTheInterruptFieldUntilTheirRegisterIsRead) {
  for (std::size_t i = 0; i < 3; ++i) master.read(i, reg::kDlStatus, 2);  // links came up: an event
  master.run(Command::kBwr, 0, reg::kEventMask, {0x0C, 0x00});
  EXPECT_EQ(master.run(Command::kNop, 0, 0, Bytes(1)).interrupt, 0x0000);
  bus.slave(1).report_error(AlState::kInit, 0x0050);
  EXPECT_EQ(master.run(Command::kNop, 0, 0, Bytes(1)).interrupt, 0x0008);
  EXPECT_EQ(master.al_status(1), 0x0011);
  EXPECT_EQ(master.run(Command::kNop, 0, 0, Bytes(1)).interrupt, 0x0000);
}

}  // namespace bus_addressing_test
}  // namespace sim::bus::test
