// The gripper behind the mailbox of arm joint 5.
#include <gtest/gtest.h>

#include "sim/bus/gripper_board.h"
#include "tests/sim/tmcm_bench.h"
#include "tests/support/no_alloc_guard.h"

namespace sim::bus::test {
namespace gripper_board_test {

using drivers::tmcl::Command;

// The defaults: speed 1000, pulse divisor 3.
constexpr double kMicrosteps_per_ms = 16e6 * 1000 / (8 * 2048.0 * 32) / 1000;

class Gripper : public ::testing::Test {
 protected:
  Gripper() {
    bench.board.attach(gripper);
    bench.bring_up(AlState::kPreOp);
  }
  drivers::tmcl::Reply ask(Command command, std::uint8_t type, std::int32_t value, std::uint8_t bar) {
    return bench.ask(command, type, value, bar, drivers::tmcl::kGripperModule);
  }
  std::int32_t get(std::uint8_t number, std::uint8_t bar) {
    return ask(Command::kGetAxisParameter, number, 0, bar).value;
  }
  void move(Command command, std::int32_t value, std::uint8_t type) {
    for (std::uint8_t bar = 0; bar < 2; ++bar) EXPECT_EQ(ask(command, type, value, bar).status, Status::kOk);
  }

  GripperBoard gripper{{.travel = 66000, .opening = {20000, 10000}}};
  TmcmBench bench{Firmware::k148};
};

TEST_F(Gripper, AnswersWithKnownBytes) {
  // Bar 1 opens by 66000: fact sheet, section 7. The reply names module 1 and echoes.
  EXPECT_EQ(bench.ask({0x01, 0x04, 0x01, 0x00, 0xFF, 0xFE, 0xFE, 0x30}),
            (Telegram{0x02, 0x01, 0x64, 0x04, 0xFF, 0xFE, 0xFE, 0x30}));
  EXPECT_EQ(bench.ask({0x01, 0x06, 0x00, 0x00, 0, 0, 0, 0}),
            (Telegram{0x02, 0x01, 0x64, 0x06, 0xFF, 0xFE, 0xFE, 0x30}))
      << "target";
  EXPECT_EQ(bench.ask({0x01, 0x06, 0x08, 0x00, 0, 0, 0, 0}), (Telegram{0x02, 0x01, 0x64, 0x06, 0, 0, 0, 0}))
      << "not there yet";
}

TEST_F(Gripper, OpeningIsNegativeAndTakesItsTime) {
  EXPECT_EQ(ask(Command::kMoveToPosition, 0, -3051, 0).status, Status::kOk);  // 100 ms at 30.52 microsteps/ms
  bench.pass(90);
  EXPECT_EQ(get(8, 0), 0);  // the answer takes 6 ms and comes before the 100th
  bench.pass(10);
  EXPECT_EQ(get(8, 0), 1);
  EXPECT_EQ(get(1, 0), -3051);
  EXPECT_DOUBLE_EQ(gripper.opening(0), 23051);
  EXPECT_DOUBLE_EQ(gripper.opening(1), 10000) << "the other bar stays";
}

TEST_F(Gripper, SpeedFollowsParameter4) {
  EXPECT_EQ(ask(Command::kSetAxisParameter, 4, 500, 0).status, Status::kOk);
  EXPECT_EQ(ask(Command::kSetAxisParameter, 4, 2048, 0).status, Status::kInvalidValue);
  EXPECT_EQ(ask(Command::kMoveToPosition, 0, -40000, 0).status, Status::kOk);
  const double before = gripper.opening(0);
  bench.pass(100);
  EXPECT_NEAR(gripper.opening(0) - before, 50 * kMicrosteps_per_ms, 1e-6);
}

TEST_F(Gripper, LosesStepsAtTheStopsAsItsCalibrationWants) {
  move(Command::kMoveToPosition, -66000, 1);  // open by the whole travel
  bench.pass(4000);
  EXPECT_EQ(get(8, 0), 1);
  EXPECT_DOUBLE_EQ(gripper.opening(0), 66000);
  EXPECT_DOUBLE_EQ(gripper.opening(1), 66000);
  move(Command::kMoveToPosition, 66000, 1);  // and close by it
  bench.pass(4000);
  EXPECT_DOUBLE_EQ(gripper.opening(0), 0);
  EXPECT_DOUBLE_EQ(gripper.opening(1), 0);
  move(Command::kSetAxisParameter, 0, 1);
  EXPECT_EQ(get(1, 0), 0);
  EXPECT_EQ(get(8, 0), 1) << "setting the counter moves nothing";
  move(Command::kMoveToPosition, -30000, 0);
  bench.pass(2000);
  EXPECT_DOUBLE_EQ(gripper.opening(0), 30000);
  EXPECT_DOUBLE_EQ(gripper.opening(1), 30000);
}

TEST_F(Gripper, ShowsAStallWhileItPushesAndStandstillAfterwards) {
  EXPECT_EQ(get(208, 0), 1 << 7);
  EXPECT_EQ(ask(Command::kMoveToPosition, 1, 60000, 0).status, Status::kOk);
  bench.pass(20);
  EXPECT_EQ(get(208, 0), 0);
  bench.pass(700);  // 20000 microsteps to the stop take 655 ms, the command 1966 ms
  EXPECT_EQ(get(208, 0), 1 << 0);
  EXPECT_EQ(get(206, 0), 0);
  bench.pass(1300);
  EXPECT_EQ(get(208, 0), 1 << 7);
}

TEST_F(Gripper, AnObjectBetweenTheBarsStopsThem) {
  gripper.hold_object(5000);
  move(Command::kMoveToPosition, 60000, 1);
  bench.pass(2000);
  EXPECT_DOUBLE_EQ(gripper.opening(0), 5000);
  EXPECT_EQ(get(8, 0), 1) << "the motors count steps and notice nothing";
}

TEST_F(Gripper, RotatesAndStopsOnCommand) {
  EXPECT_EQ(ask(Command::kRotateLeft, 0, 1000, 0).status, Status::kOk);
  bench.pass(50);
  EXPECT_EQ(get(3, 0), -1000);
  EXPECT_EQ(ask(Command::kMotorStop, 0, 0, 0).status, Status::kOk);
  const double stopped = gripper.opening(0);
  EXPECT_GT(stopped, 20000);
  bench.pass(100);
  EXPECT_NEAR(gripper.opening(0), stopped, 1);  // the counter is rounded to a microstep
  EXPECT_EQ(get(3, 0), 0);
}

TEST_F(Gripper, RemembersItsCalibrationUntilPowerOff) {
  EXPECT_EQ(bench.ask({0x01, 0x09, 16, 2, 0, 0, 0, 1}), (Telegram{0x02, 0x01, 0x64, 0x09, 0, 0, 0, 1}));
  EXPECT_EQ(bench.ask({0x01, 0x0A, 16, 2, 0, 0, 0, 0}), (Telegram{0x02, 0x01, 0x64, 0x0A, 0, 0, 0, 1}));
  EXPECT_EQ(bench.ask({0x00, 0x0A, 16, 2, 0, 0, 0, 0}), (Telegram{0x02, 0x00, 0x64, 0x0A, 0, 0, 0, 0}))
      << "not the drive's";
  EXPECT_EQ(ask(Command::kMoveToPosition, 0, -1000, 0).status, Status::kOk);
  bench.pass(100);
  bench.bus.set_power(0, false);
  bench.bus.set_power(0, true);
  bench.bring_up(AlState::kPreOp);
  EXPECT_EQ(ask(Command::kGetGlobalParameter, 16, 0, 2).value, 0);
  EXPECT_EQ(get(1, 0), 0);
  EXPECT_DOUBLE_EQ(gripper.opening(0), 21000) << "the spindles hold";
}

TEST_F(Gripper, TakesLongerToAnswerThanTheDrive) {
  const auto cycles = [this](std::uint8_t module) {
    Bytes request(TmcmBench::kMailbox);
    request[0] = module;
    request[1] = 6;
    request[2] = 1;
    bench.master.write(0, 0x1000, request);
    int count = 0;
    do {
      bench.pass(1);
      ++count;
    } while (bench.master.read(0, 0x1040, TmcmBench::kMailbox).counter == 0 && count < 100);
    return count;
  };
  EXPECT_EQ(cycles(0), 1);
  EXPECT_EQ(cycles(1), 6);  // gripper_latency is 5 ms
}

TEST_F(Gripper, ReportsItsVersion) {
  const Telegram reply = bench.ask({0x01, 136, 0, 0, 0, 0, 0, 0});
  drivers::tmcl::FirmwareVersion version;
  ASSERT_EQ(drivers::tmcl::parse_version(reply, version), drivers::tmcl::VersionText::kValid);
  EXPECT_EQ(version, (drivers::tmcl::FirmwareVersion{.controller = 842, .version = 200}));
}

TEST_F(Gripper, RefusesWhatItHasNot) {
  EXPECT_EQ(ask(Command::kGetAxisParameter, 9, 0, 0).status, Status::kWrongType);
  EXPECT_EQ(ask(Command::kSetAxisParameter, 8, 0, 0).status, Status::kWrongType) << "read only";
  EXPECT_EQ(ask(Command::kGetAxisParameter, 1, 0, 2).status, Status::kInvalidValue) << "no third bar";
  EXPECT_EQ(ask(Command::kStoreAxisParameter, 4, 0, 0).status, Status::kInvalidCommand);
}

TEST_F(Gripper, DoesNotAllocateOrLock) {
  const support::NoAllocGuard guard;
  for (std::uint8_t number = 0; number < 255; ++number) {
    gripper.execute({.module = 1, .type = number});
    gripper.advance(1ms);
  }
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace gripper_board_test
}  // namespace sim::bus::test
