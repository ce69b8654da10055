// Cables, power, damaged frames and clocks.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/bus_hand_master.h"

namespace sim::bus::test {
namespace bus_topology_test {

class Line : public ::testing::Test {
 protected:
  Line() {
    for (int i = 0; i < 4; ++i) bus.add(drive());
  }
  std::uint16_t count() { return master.run(Command::kBrd, 0, reg::kType, Bytes(1)).counter; }
  std::uint64_t dl_status(std::size_t slave) { return master.read(slave, reg::kDlStatus, 2).number(); }
  Bytes counters(std::size_t slave) { return master.read(slave, reg::kRxErrorCounters, 20).data; }

  EmulatedBus bus;
  HandMaster master{bus};
};

TEST_F(Line, LinksShowInDlStatus) {
  // EEPROM loaded, firmware alive; links and communication on ports 0 and 1; ports 2 and 3 closed.
  EXPECT_EQ(dl_status(0), 0x5A33U);
  EXPECT_EQ(dl_status(2), 0x5A33U);
  EXPECT_EQ(dl_status(3), 0x5613U);  // port 1: no link, loop closed
}

TEST_F(Line, APulledCableCutsOffWhatIsBehindIt) {
  master.bring_up(AlState::kOp);
  EXPECT_EQ(master.exchange(Bytes(100)).counter, 12);
  bus.set_cable(2, false);
  EXPECT_EQ(count(), 2);
  EXPECT_EQ(master.exchange(Bytes(100)).counter, 6);
  EXPECT_EQ(dl_status(1), 0x5613U);
  EXPECT_EQ(counters(1)[17], 1) << "lost link, port 1";
  EXPECT_EQ(counters(0)[17], 0);
  bus.advance(100ms);
  bus.set_cable(2, true);
  EXPECT_EQ(count(), 4);
  EXPECT_EQ(dl_status(1), 0x5A33U);
  EXPECT_EQ(counters(2)[16], 1) << "lost link, port 0";
  EXPECT_EQ(master.al_status(2), 0x0014) << "they kept their power and their watchdogs ran";
  EXPECT_EQ(master.al_code(3), 0x001B);
  EXPECT_EQ(master.read(3, reg::kStationAddress, 2).number(), kStation + 3U);
}

TEST_F(Line, WithoutTheFirstCableNothingReturns) {
  bus.set_cable(0, false);
  Bytes frame = HandFrame().add(Command::kBrd, 0, Bytes(1)).bytes();
  const Bytes before = frame;
  EXPECT_FALSE(bus.process(frame));
  EXPECT_EQ(frame, before);
}

TEST(EmptyLine, NothingReturns) {
  EmulatedBus bus;
  Bytes frame = HandFrame().add(Command::kBrd, 0, Bytes(1)).bytes();
  EXPECT_FALSE(bus.process(frame));
}

TEST_F(Line, APowerCycleForgetsEverythingButTheEeprom) {
  RecordingBoard board(bus.slave(1));
  master.bring_up(AlState::kOp);
  master.write(1, 0x1800, {0x77});
  bus.set_power(1, false);
  EXPECT_FALSE(board.powered);
  EXPECT_EQ(count(), 1) << "a slave without power breaks the line";
  bus.advance(10ms);
  EXPECT_EQ(board.time, 0ms);
  bus.set_power(1, true);
  EXPECT_TRUE(board.powered);
  EXPECT_EQ(count(), 4);
  EXPECT_EQ(master.al_status(1), 0x0001);
  EXPECT_EQ(master.al_code(1), 0x0000);
  EXPECT_EQ(master.read(1, reg::kStationAddress, 2).number(), 0U);
  EXPECT_EQ(master.read(1, reg::kSyncManager, 8).data, (Bytes{0, 0, 0, 0, 0, 0x30, 0, 1}));
  EXPECT_EQ(master.read(1, reg::kFmmu, 16).data, Bytes(16));
  EXPECT_EQ(master.read(1, 0x1800, 1).data, (Bytes{0}));
  EXPECT_EQ(dl_status(1), 0x5A33U);
  EXPECT_EQ(counters(0)[17], 1);
  EXPECT_EQ(counters(2)[16], 1);
  EXPECT_EQ(master.al_status(0), 0x0008);
  EXPECT_EQ(master.exchange(Bytes(100)).counter, 9);
}

TEST_F(Line, APortClosedByDlControlTurnsFramesRound) {
  master.write(1, reg::kDlControl, 0x0007'0C01, 4);  // port 1 closed
  EXPECT_EQ(count(), 2);
  EXPECT_EQ(dl_status(1), 0x5633U) << "link, but closed";
  master.write(1, reg::kDlControl, 0x0007'0001, 4);
  EXPECT_EQ(count(), 4);
  EXPECT_EQ(counters(1)[17], 0);
}

TEST_F(Line, APortForcedOpenWithoutLinkLosesFrames) {
  EXPECT_TRUE(master.write(3, reg::kDlControl, 0x0007'0801, 4).returned) << "in force behind this frame";
  EXPECT_FALSE(master.run(Command::kBrd, 0, reg::kType, Bytes(1)).returned);
}

TEST_F(Line, ADamagedFrameIsCountedWhereItHappenedAndHasNoEffect) {
  bus.damage(2, 1);
  EXPECT_FALSE(master.run(Command::kBwr, 0, reg::kStationAddress, {0x55, 0x00}).returned);
  EXPECT_EQ(master.read(1, reg::kStationAddress, 2).number(), 0x55U);
  EXPECT_EQ(master.read(2, reg::kStationAddress, 2).number(), 0U);
  EXPECT_EQ(master.read(3, reg::kStationAddress, 2).number(), 0U);
  EXPECT_EQ(counters(2)[0], 1) << "invalid frame, port 0";
  EXPECT_EQ(counters(2)[8], 0);
  EXPECT_EQ(counters(2)[12], 1) << "processing unit";
  EXPECT_EQ(counters(3)[0], 0);
  EXPECT_EQ(counters(3)[8], 1) << "forwarded, port 0";
  EXPECT_EQ(counters(0)[9], 1) << "forwarded, port 1: on its way back";
  EXPECT_EQ(counters(0)[0] + counters(0)[8], 0);
  EXPECT_EQ(count(), 4) << "one frame only";
}

TEST_F(Line, ADamagedFrameBringsNoOutputsAndNoMessage) {
  RecordingBoard board(bus.slave(2));
  master.bring_up(AlState::kOp);
  Bytes message(32, 0x77);
  bus.damage(2, 1);
  master.run(HandFrame()
                 .add(Command::kLrw, kLogical, Bytes(100, 0x55))
                 .add(Command::kFpwr, drivers::ethercat::address_of(kStation + 2, 0x1000), message));
  EXPECT_EQ(board.outputs, Bytes(5));
  EXPECT_TRUE(board.request.empty());
  master.run(Command::kFpwr, kStation + 2, 0x1000, message);
  EXPECT_EQ(board.request, message);
}

TEST_F(Line, ErrorCountersStopAt255AndAreClearedInGroups) {
  bus.damage(2, 300);
  for (int i = 0; i < 300; ++i) count();
  EXPECT_EQ(counters(2)[0], 255);
  master.write(2, reg::kRxErrorCounters, {0});
  EXPECT_EQ(counters(2)[0], 0);
  EXPECT_EQ(counters(2)[12], 255);
  master.write(3, reg::kForwardedErrorCounters + 3, {0});
  EXPECT_EQ(counters(3)[8], 0);
  bus.set_cable(3, false);
  bus.set_cable(3, true);
  EXPECT_EQ(counters(2)[17], 1);
  master.write(2, reg::kLostLinkCounters, {0});
  EXPECT_EQ(counters(2)[17], 0);
}

TEST_F(Line, AFrameThatIsNotEthercatIsDestroyedAndCounted) {
  Bytes frame(60);
  frame[12] = 0x08;  // IPv4
  EXPECT_FALSE(bus.process(frame));
  EXPECT_EQ(counters(0)[12], 1);
  EXPECT_EQ(counters(1)[8], 1);
}

// ---- clocks ----

std::uint32_t port_time(HandMaster& master, std::size_t slave, std::uint16_t port) {
  return static_cast<std::uint32_t>(
      master.read(slave, static_cast<std::uint16_t>(reg::kDcReceiveTimes + 4 * port), 4).number());
}

TEST_F(Line, ReceiveTimesDifferByTheWayThereAndBack) {
  bus.advance(5ms);
  master.run(Command::kBwr, 0, reg::kDcReceiveTimes, Bytes(4));
  constexpr std::uint32_t kHop = 450;  // cable and pass
  EXPECT_EQ(port_time(master, 0, 0), 5'000'150U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(port_time(master, i, 0), 5'000'150U + kHop * i);
    const std::uint32_t behind = static_cast<std::uint32_t>(3 - i);
    EXPECT_EQ(port_time(master, i, 1), behind == 0 ? 0U : port_time(master, i, 0) + 2 * kHop * behind);
    EXPECT_EQ(master.read(i, reg::kDcReceiveTimeUnit, 8).number(), port_time(master, i, 0));
  }
  // The formula of the data sheet, section I, 9.1.2: half of what the round trips differ.
  for (std::size_t i = 0; i + 1 < 4; ++i) {
    const auto round = [this](std::size_t k) {
      return k == 3 ? 0 : port_time(master, k, 1) - port_time(master, k, 0);
    };
    EXPECT_EQ((round(i) - round(i + 1)) / 2, kHop);
  }
}

TEST_F(Line, ReceiveTimesAreLatchedByAWriteOnly) {
  bus.advance(1ms);
  EXPECT_EQ(port_time(master, 0, 0), 0U);
  master.write(0, reg::kDcReceiveTimes, Bytes(4));
  EXPECT_EQ(port_time(master, 0, 0), 1'000'150U);
  EXPECT_EQ(port_time(master, 1, 0), 0U);
}

TEST(Clock, HasItsOwnStartAndRate) {
  EmulatedBus bus;
  bus.add(drive(), {.crystal = {.start_ns = 1'000'000, .drift_ppm = 50.0}});
  HandMaster master(bus);
  bus.advance(1s);
  const std::uint64_t time = master.read(0, reg::kDcSystemTime, 8).number();
  EXPECT_EQ(time, 1'000'000U + 1'000'000'150U + 50'000U);
  master.write(0, reg::kDcSystemTimeOffset, 7'000'000'000, 8);
  master.write(0, reg::kDcSystemTimeDelay, 150, 4);
  EXPECT_EQ(master.read(0, reg::kDcSystemTime, 8).number(), time + 7'000'000'000 - 150);
}

TEST(Clock, WithoutOneTheRegistersAreEmpty) {
  EmulatedBus bus;
  bus.add(power_board());
  HandMaster master(bus);
  bus.advance(1ms);
  EXPECT_EQ(master.read(0, reg::kFeatures, 2).number(), 0U);
  master.write(0, reg::kDcReceiveTimes, Bytes(4));
  master.write(0, reg::kDcSystemTimeOffset, 77, 8);
  EXPECT_EQ(master.read(0, reg::kDcReceiveTimes, 64).data, Bytes(64));
}

TEST(Clock, FollowsTheReferenceThroughDistributedSystemTime) {
  EmulatedBus bus;
  bus.add(drive(), {.crystal = {.start_ns = 0, .drift_ppm = 20.0}});
  bus.add(drive(), {.crystal = {.start_ns = 123'456, .drift_ppm = -30.0}});
  HandMaster master(bus);
  master.configure();
  // Offset and delay as a master computes them.
  master.run(Command::kBwr, 0, reg::kDcReceiveTimes, Bytes(4));
  const std::int64_t offset = std::int64_t{port_time(master, 0, 0)} + 450 - port_time(master, 1, 0);
  master.write(1, reg::kDcSystemTimeOffset, static_cast<std::uint64_t>(offset), 8);
  master.write(1, reg::kDcSystemTimeDelay, 450, 4);
  master.write(1, reg::kDcSpeedCounterStart, 0x1000, 2);

  const auto difference = [&] {
    const std::uint64_t raw = master.read(1, reg::kDcSystemTimeDifference, 4).number();
    return static_cast<double>(raw & 0x7FFF'FFFF) * ((raw >> 31) != 0 ? -1.0 : 1.0);
  };
  for (int i = 0; i < 20; ++i) {
    bus.advance(1ms);
    master.run(Command::kFrmw, kStation, reg::kDcSystemTime, Bytes(8));
  }
  EXPECT_LT(difference(), -100.0) << "50 ppm slower: bit 31 says it is behind";
  for (int i = 0; i < 1000; ++i) {
    bus.advance(1ms);
    master.run(Command::kFrmw, kStation, reg::kDcSystemTime, Bytes(8));
  }
  EXPECT_LE(std::abs(difference()), 2.0);  // two counts of the clocks' nanosecond
  EXPECT_NEAR(bus.slave(1).controller().clock().correction_ppm(), 50.0, 0.5);
  // The data sheet's formula for the deviation of the clocks, section II, table 105.
  const auto d = static_cast<double>(master.read(1, reg::kDcSpeedCounterDifference, 2).number());
  EXPECT_NEAR(1e6 * d / (5 * (0x1000 + d + 2) * (0x1000 - d + 2)), 50.0, 0.5);
  master.write(1, reg::kDcSpeedCounterStart, 0x1000, 2);
  EXPECT_EQ(master.read(1, reg::kDcSystemTimeDifference, 8).data, (Bytes{0, 0, 0, 0, 0, 0x10, 0, 0}));
}

}  // namespace bus_topology_test
}  // namespace sim::bus::test
