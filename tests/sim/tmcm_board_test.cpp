// The motor controller: modes, flags, watchdog, thermal guard, power.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <set>

#include "tests/sim/tmcm_bench.h"
#include "tests/support/no_alloc_guard.h"

namespace sim::bus::test {
namespace tmcm_board_test {

constexpr std::int32_t kPassword = 4711;
// TmcmBench: 4000 ticks and 10 motor turns per joint turn.
constexpr double kRadPerTick = 2 * std::numbers::pi / 40000;

std::int32_t load(std::span<const std::uint8_t> bytes, std::size_t offset) {
  return drivers::ethercat::load_le<std::int32_t>(&bytes[offset]);
}

class EitherFirmware : public ::testing::TestWithParam<Firmware> {
 protected:
  TmcmBench bench{GetParam()};
};
INSTANTIATE_TEST_SUITE_P(Firmware, EitherFirmware, ::testing::Values(Firmware::k148, Firmware::k200),
                         [](const auto& firmware) {
                           return firmware.param == Firmware::k148 ? "148" : "200";
                         });

// ---- process data ----

TEST(TmcmBoard, Firmware148ShowsPwmWhereFirmware200ShowsTargets) {
  for (const Firmware firmware : {Firmware::k148, Firmware::k200}) {
    TmcmBench bench(firmware);
    bench.start();
    bench.run(20, {ControllerMode::kCurrent, -1000});
    std::array<std::uint8_t, 40> bytes{};
    bench.board.inputs(bytes);
    // Current -1000 mA at byte 4, little-endian; flags at 12: current mode (11), initialised (15), halted
    // (4).
    EXPECT_EQ(load(bytes, 4), -1000);
    EXPECT_EQ(load(bytes, 8), 0);
    EXPECT_EQ(load(bytes, 12), 1 << 11 | 1 << 15 | 1 << 4);
    if (firmware == Firmware::k148) {
      EXPECT_EQ(load(bytes, 16), std::lround(-1799 * 0.978 / 24));  // R·I of the supply
      EXPECT_EQ(load(bytes, 20), 0);
    } else {
      EXPECT_EQ(load(bytes, 20), -1000);
    }
    for (std::size_t i = 32; i < 40; ++i) EXPECT_EQ(bytes[i], 0) << "unused";
  }
}

TEST_P(EitherFirmware, VelocityModeTurnsTheMotorAndSaysSo) {
  bench.start();
  const std::int32_t before = bench.input.position_ticks;
  bench.run(1000, {ControllerMode::kVelocity, 600});
  EXPECT_EQ(bench.input.velocity_rpm, 600);
  EXPECT_TRUE(bench.has(StatusFlag::kVelocityMode));
  EXPECT_FALSE(bench.has(StatusFlag::kMotorHalted));
  // 600 rpm are 40 ticks/ms; the ramp of 2000 rpm/s takes 0.3 s and costs half of that: 850 ms of full speed.
  EXPECT_NEAR(bench.input.position_ticks - before, 34000, 200);
}

TEST_P(EitherFirmware, PositionModeReachesItsTargetAndSaysSo) {
  bench.start();
  bench.run(10, {ControllerMode::kPosition, 20000});
  EXPECT_TRUE(bench.has(StatusFlag::kPositionMode));
  EXPECT_FALSE(bench.has(StatusFlag::kPositionReached));
  bench.run(3000, {ControllerMode::kPosition, 20000});
  EXPECT_NEAR(bench.input.position_ticks, 20000, 5);  // parameter 10
  EXPECT_TRUE(bench.has(StatusFlag::kPositionReached));
  EXPECT_TRUE(bench.has(StatusFlag::kMotorHalted));
}

TEST_P(EitherFirmware, PositionModeWithoutRampGetsThereToo) {
  bench.start();
  EXPECT_EQ(bench.set(146, 0), Status::kOk);
  bench.run(1500, {ControllerMode::kPosition, -20000});
  EXPECT_NEAR(bench.input.position_ticks, -20000, 5);  // parameter 10
}

TEST_P(EitherFirmware, CurrentModeDeliversTheCurrentUpToParameter6) {
  bench.start();
  bench.run(5, {ControllerMode::kCurrent, 1500});
  EXPECT_EQ(bench.input.current_mA, 1500);
  EXPECT_TRUE(bench.has(StatusFlag::kCurrentMode));
  bench.run(5, {ControllerMode::kCurrent, 9000});
  EXPECT_EQ(bench.input.current_mA, 3000);
}

TEST_P(EitherFirmware, PwmModeDrivesTheCurrentThatTheWindingLets) {
  bench.start();
  bench.run(5, {ControllerMode::kPwm, 180});
  EXPECT_EQ(bench.input.current_mA, std::lround(1000 * 24.0 * 180 / 1799 / 0.978));
  EXPECT_EQ(bench.has(StatusFlag::kPwmMode), GetParam() == Firmware::k148) << "removed in 2.0";
}

TEST_P(EitherFirmware, MotorStopHoldsVelocityZero) {
  bench.start();
  bench.run(500, {ControllerMode::kVelocity, 600});
  bench.run(500, {ControllerMode::kMotorStop, 0});
  EXPECT_EQ(bench.input.velocity_rpm, 0);
  EXPECT_TRUE(bench.has(StatusFlag::kMotorHalted));
  EXPECT_TRUE(bench.joint.enabled);
}

TEST_P(EitherFirmware, NoMoreActionLeavesMotionCommandsOfTheMailboxAlone) {
  bench.start();
  bench.run(5, {ControllerMode::kNoMoreAction, 0});
  EXPECT_EQ(bench.ask(drivers::tmcl::Command::kRotateLeft, 0, 300).status, Status::kOk);
  bench.run(1000, {ControllerMode::kNoMoreAction, 0});
  EXPECT_EQ(bench.input.velocity_rpm, -300);
  EXPECT_EQ(bench.ask(drivers::tmcl::Command::kMotorStop, 0).status, Status::kOk);
  bench.run(1000, {ControllerMode::kNoMoreAction, 0});
  EXPECT_EQ(bench.input.velocity_rpm, 0);
}

TEST_P(EitherFirmware, SetPositionToReferenceLoadsTheCounterAndMovesNothing) {
  bench.start();
  const double before = bench.joint.position_rad;
  bench.run(5, {ControllerMode::kSetPositionToReference, 12345});
  EXPECT_EQ(bench.input.position_ticks, 12345);
  bench.run(100, {ControllerMode::kVelocity, 0});
  EXPECT_EQ(bench.input.position_ticks, 12345);
  EXPECT_EQ(bench.joint.position_rad, before);
}

TEST_P(EitherFirmware, TheCounterWraps) {
  bench.start();
  bench.run(2, {ControllerMode::kSetPositionToReference, INT32_MAX});
  bench.run(500, {ControllerMode::kVelocity, 300});
  EXPECT_LT(bench.input.position_ticks, INT32_MIN + 20000);
  EXPECT_GT(bench.input.position_ticks, INT32_MIN);
}

TEST_P(EitherFirmware, AnUnknownModeChangesNothing) {
  bench.start();
  bench.run(500, {ControllerMode::kVelocity, 300});
  bench.run(500, {static_cast<ControllerMode>(8), 0});
  EXPECT_EQ(bench.input.velocity_rpm, 300);
}

TEST_P(EitherFirmware, AnInvertedAxisTurnsTheOtherWay) {
  TmcmOptions options = TmcmBench::options_for(GetParam());
  options.axis.inverted = true;
  TmcmBench inverted(options);
  inverted.start();
  const double before = inverted.joint.position_rad;
  const std::int32_t ticks_before = inverted.input.position_ticks;
  inverted.run(500, {ControllerMode::kVelocity, 300});
  inverted.run(500, {ControllerMode::kVelocity, 0});
  // Exact to half a tick at either end.
  EXPECT_NEAR(inverted.joint.position_rad - before,
              -kRadPerTick * (inverted.input.position_ticks - ticks_before), kRadPerTick);
  EXPECT_LT(inverted.joint.position_rad, before);
  inverted.run(5, {ControllerMode::kCurrent, 1000});
  EXPECT_EQ(inverted.input.current_mA, 1000);
  EXPECT_LT(inverted.joint.torque_Nm, 0);
}

TEST_P(EitherFirmware, AnAbsoluteCurrentSensorLosesTheSign) {
  TmcmOptions options = TmcmBench::options_for(GetParam());
  options.current_sign = drivers::tmcl::CurrentSign::kAbsolute;
  TmcmBench absolute(options);
  absolute.start();
  absolute.run(5, {ControllerMode::kCurrent, -1000});
  EXPECT_EQ(absolute.input.current_mA, 1000);
  EXPECT_EQ(absolute.get(150), 1000);
}

// ---- commutation ----

TEST_P(EitherFirmware, WithoutCommutationNothingMoves) {
  bench.bring_up();
  bench.run(50, {ControllerMode::kCurrent, 1000});
  bench.run(50, {ControllerMode::kPosition, 10000});
  EXPECT_FALSE(bench.joint.enabled);
  EXPECT_EQ(bench.joint.position_rad, 0);
  EXPECT_FALSE(bench.has(StatusFlag::kInitialized));
  EXPECT_EQ(bench.get(15), 0);
}

TEST(TmcmBoard, Firmware148InitialisesOnMode7WithoutMoving) {
  TmcmBench bench(Firmware::k148);
  bench.bring_up();
  bench.run(400, {ControllerMode::kVelocity, 100});
  EXPECT_FALSE(bench.has(StatusFlag::kInitialized)) << "not by a velocity";
  bench.run(490, {ControllerMode::kInitialize, 0});
  EXPECT_FALSE(bench.has(StatusFlag::kInitialized));
  bench.run(20, {ControllerMode::kInitialize, 0});
  EXPECT_TRUE(bench.has(StatusFlag::kInitialized));
  EXPECT_EQ(bench.joint.position_rad, 0);
  EXPECT_EQ(bench.get(15), 1);
}

TEST(TmcmBoard, Firmware200InitialisesOnAVelocityWithASmallMotion) {
  TmcmBench bench(Firmware::k200);
  bench.bring_up();
  bench.run(600, {ControllerMode::kInitialize, 0});
  EXPECT_FALSE(bench.has(StatusFlag::kInitialized)) << "not by mode 7";
  int cycles = 0;
  while (!bench.has(StatusFlag::kInitialized) && cycles < 5000) {
    bench.run(1, {ControllerMode::kVelocity, 100});
    ++cycles;
  }
  // An electrical revolution is 500 ticks of 4000 for 16 poles: 75 ms at 100 rpm, and the ramp before.
  EXPECT_NEAR(cycles, 100, 10);
  EXPECT_NEAR(bench.joint.position_rad, 500 * kRadPerTick, 30 * kRadPerTick);  // found out some cycles late
  EXPECT_EQ(bench.get(15), 1);
}

TEST(TmcmBoard, Parameter15InitialisesEitherFirmware) {
  for (const Firmware firmware : {Firmware::k148, Firmware::k200}) {
    TmcmBench bench(firmware);
    bench.bring_up(AlState::kPreOp);
    EXPECT_EQ(bench.set(15, 1), Status::kOk);
    bench.pass(600);
    EXPECT_EQ(bench.get(15), 1);
    bench.pass(200);
    EXPECT_EQ(bench.get(3), 0) << "it does not go on turning";
  }
}

TEST(TmcmBoard, ABlockedRotorIsNotInitialisedByFirmware200) {
  TmcmBench bench(Firmware::k200);
  bench.bring_up();
  bench.joint.blocked = true;
  bench.run(2600, {ControllerMode::kVelocity, 100});
  EXPECT_TRUE(bench.has(StatusFlag::kInitializationError));
  EXPECT_FALSE(bench.has(StatusFlag::kInitialized));
  bench.joint.blocked = false;
  bench.run(500, {ControllerMode::kVelocity, 100});
  EXPECT_TRUE(bench.has(StatusFlag::kInitializationError)) << "only a new attempt helps";
  bench.run(2, {ControllerMode::kVelocity, 0});
  bench.run(300, {ControllerMode::kVelocity, 100});
  EXPECT_TRUE(bench.has(StatusFlag::kInitialized));
  EXPECT_FALSE(bench.has(StatusFlag::kInitializationError));
}

TEST(TmcmBoard, AHallSensorErrorFailsTheInitialisationOfFirmware148) {
  TmcmBench bench(Firmware::k148);
  bench.bring_up();
  bench.slave.set_fault(BoardFault::kHallSensor, true);
  bench.run(600, {ControllerMode::kInitialize, 0});
  EXPECT_TRUE(bench.has(StatusFlag::kHallSensorError));
  EXPECT_TRUE(bench.has(StatusFlag::kInitializationError));
  bench.slave.set_fault(BoardFault::kHallSensor, false);
  bench.run(2, {ControllerMode::kMotorStop, 0});
  bench.run(600, {ControllerMode::kInitialize, 0});
  EXPECT_FALSE(bench.has(StatusFlag::kInitializationError));
  EXPECT_TRUE(bench.has(StatusFlag::kInitialized));
}

TEST_P(EitherFirmware, TheHallAngleFollowsTheRotorInSixthsOfAnElectricalRevolution) {
  bench.start();
  // Eight pole pairs, gear 10, and whatever the encoder counts.
  bench.slave.set_fault(BoardFault::kStuckEncoder, true);
  std::set<std::int32_t> angles;
  std::int32_t last = 0;
  int changes = 0;
  for (int i = 0; i < 600; ++i) {
    bench.joint.position_rad = 2 * std::numbers::pi / 80 * i / 300;  // two electrical revolutions
    const std::int32_t angle = bench.get(210);
    EXPECT_LE(std::abs(angle), 32768);
    if (i > 0 && angle != last) ++changes;
    last = angle;
    angles.insert(angle);
  }
  EXPECT_EQ(angles.size(), 6U);
  EXPECT_EQ(changes, 12);
}

// ---- watchdog ----

TEST_P(EitherFirmware, LateProcessDataStopTheMotorUntilTheFlagIsCleared) {
  bench.start();
  bench.run(1000, {ControllerMode::kVelocity, 600});
  bench.pass(99);
  EXPECT_FALSE(bench.board.input().flags.has(StatusFlag::kTimeout)) << "parameter 90 is 100 ms";
  bench.pass(3);
  EXPECT_TRUE(bench.board.input().flags.has(StatusFlag::kTimeout));
  bench.pass(2000);
  EXPECT_EQ(bench.board.input().velocity_rpm, 0);
  EXPECT_TRUE(bench.joint.enabled) << "held, not let go";

  bench.bring_up();  // the slave's own watchdog took it out of OP
  bench.run(500, {ControllerMode::kVelocity, 600});
  EXPECT_TRUE(bench.has(StatusFlag::kTimeout)) << "latched";
  EXPECT_EQ(bench.input.velocity_rpm, 0);
  EXPECT_EQ(bench.ask({0x00, 0x05, 0x9E, 0x00, 0x00, 0x00, 0x00, 0x01}),
            (Telegram{0x02, 0x00, 0x64, 0x05, 0x00, 0x00, 0x00, 0x01}));
  bench.run(1000, {ControllerMode::kVelocity, 600});
  EXPECT_FALSE(bench.has(StatusFlag::kTimeout));
  EXPECT_EQ(bench.input.velocity_rpm, 600);
}

TEST_P(EitherFirmware, TheWatchdogStartsWithTheFirstProcessData) {
  bench.bring_up(AlState::kPreOp);
  bench.pass(1000);
  EXPECT_FALSE(bench.board.input().flags.has(StatusFlag::kTimeout));
}

// ---- thermal guard ----

TEST_P(EitherFirmware, I2tTripsAfterTheTimeOfTheFormulaAndIsClearedOnlyWhenCool) {
  bench.start();
  // 2 A against 8 A²·s, over a winding time of 5 s: 8 / 2² = 2 s.
  ASSERT_EQ(bench.set(248, kPassword), Status::kOk);
  ASSERT_EQ(bench.set(25, 5000), Status::kOk);
  ASSERT_EQ(bench.set(26, 8000), Status::kOk);
  int cycles = 0;
  while (!bench.has(StatusFlag::kI2tExceeded) && cycles < 10000) {
    bench.run(1, {ControllerMode::kCurrent, 2000});
    ++cycles;
  }
  EXPECT_NEAR(cycles, 2000, 4);  // one cycle each for command, sensor, sum and process data
  bench.run(3, {ControllerMode::kCurrent, 2000});
  EXPECT_EQ(bench.input.current_mA, 0) << "PWM is held at zero";
  EXPECT_TRUE(bench.has(StatusFlag::kCurrentMode)) << "the mode stays";

  EXPECT_NE(bench.set(29, 1), Status::kOk) << "still hot";
  bench.run(4000, {ControllerMode::kCurrent, 0});
  EXPECT_NE(bench.set(29, 1), Status::kOk) << "still hot";
  EXPECT_TRUE(bench.has(StatusFlag::kI2tExceeded)) << "latched";
  EXPECT_EQ(bench.get(28), 5) << "a second begun counts";
  bench.run(1000, {ControllerMode::kCurrent, 0});
  EXPECT_EQ(bench.set(29, 1), Status::kOk);
  bench.run(5, {ControllerMode::kCurrent, 1000});
  EXPECT_FALSE(bench.has(StatusFlag::kI2tExceeded));
  EXPECT_EQ(bench.input.current_mA, 1000);
}

TEST(I2tMonitor, ACurrentThatTheLimitAllowsForEverNeverTrips) {
  I2tMonitor monitor;
  // 3.9 A: 15.2 A² × 13.2 s = 200.8 A²·s, under the default of 211.2. A bucket is part of the window at most.
  for (int i = 0; i < 100'000; ++i) monitor.update(3.9, 13200, 211200, 1ms);
  EXPECT_FALSE(monitor.exceeded());
  EXPECT_NEAR(monitor.sum_A2_ms(), 15.21 * 13200, 15.21 * 13200 / 100);
}

// ---- supply and sensors ----

TEST_P(EitherFirmware, SupplyAndTemperatureFaultsOpenTheBridgeWhileTheyLast) {
  bench.start();
  constexpr std::pair<BoardFault, StatusFlag> faults[] = {
      {BoardFault::kUndervoltage, StatusFlag::kUndervoltage},
      {BoardFault::kOvervoltage, StatusFlag::kOvervoltage},
      {BoardFault::kOvertemperature, StatusFlag::kOvertemperature}};
  for (const auto& [fault, flag] : faults) {
    bench.slave.set_fault(fault, true);
    bench.run(3, {ControllerMode::kCurrent, 1000});
    EXPECT_TRUE(bench.has(flag));
    EXPECT_FALSE(bench.joint.enabled);
    bench.slave.set_fault(fault, false);
    bench.run(3, {ControllerMode::kCurrent, 1000});
    EXPECT_FALSE(bench.has(flag));
    EXPECT_TRUE(bench.joint.enabled);
  }
}

TEST_P(EitherFirmware, OvercurrentShowsWhileItLasts) {
  bench.start();
  bench.run(3, {ControllerMode::kCurrent, 3000});
  ASSERT_EQ(bench.set(248, kPassword), Status::kOk);
  ASSERT_EQ(bench.set(6, 1000), Status::kOk);
  bench.joint.last = hal::JointCommand::torque_Nm(3.0);
  bench.joint.advance(0.001);
  bench.bus.advance(1ms);
  EXPECT_TRUE(bench.board.input().flags.has(StatusFlag::kOvercurrent));
  bench.pass(2);
  EXPECT_FALSE(bench.board.input().flags.has(StatusFlag::kOvercurrent));
}

TEST_P(EitherFirmware, AStuckEncoderStopsCountingAndTheCountsAreLost) {
  bench.start();
  bench.run(1000, {ControllerMode::kVelocity, 300});
  bench.slave.set_fault(BoardFault::kStuckEncoder, true);
  bench.run(2, {ControllerMode::kVelocity, 300});
  const std::int32_t stuck = bench.input.position_ticks;
  const double before = bench.joint.position_rad;
  bench.run(500, {ControllerMode::kVelocity, 300});
  EXPECT_EQ(bench.input.position_ticks, stuck);
  EXPECT_EQ(bench.input.velocity_rpm, 0);
  EXPECT_GT(bench.joint.position_rad, before);
  bench.slave.set_fault(BoardFault::kStuckEncoder, false);
  bench.run(3, {ControllerMode::kVelocity, 300});
  EXPECT_NEAR(bench.input.position_ticks, stuck, 100);  // three cycles of 20 ticks, no jump
}

TEST(TmcmBoard, EncoderGlitchesAreSingleWrongPositions) {
  TmcmBench bench(Firmware::k148);
  bench.start();
  const std::int32_t truth = bench.input.position_ticks;
  bench.board.set_encoder_glitches(true);
  int wrong = 0;
  for (int i = 0; i < 970; ++i) {
    bench.run(1, {ControllerMode::kVelocity, 0});
    if (bench.input.position_ticks != truth) ++wrong;
  }
  EXPECT_EQ(wrong, 10);
}

// ---- power ----

TEST_P(EitherFirmware, APowerCycleForgetsPositionCommutationAndRam) {
  bench.start();
  bench.run(500, {ControllerMode::kVelocity, 300});
  bench.run(500, {ControllerMode::kVelocity, 0});
  ASSERT_EQ(bench.set(10, 77), Status::kOk);
  ASSERT_EQ(bench.set(11, 1234), Status::kOk);
  ASSERT_EQ(bench.ask(drivers::tmcl::Command::kStoreAxisParameter, 11).status, Status::kOk);
  ASSERT_EQ(bench.ask(drivers::tmcl::Command::kSetGlobalParameter, 16, 1, 2).status, Status::kOk);
  ASSERT_NE(bench.get(1), 0);

  bench.bus.set_power(0, false);
  EXPECT_FALSE(bench.joint.enabled);
  bench.pass(100);
  bench.bus.set_power(0, true);
  bench.bring_up();
  bench.run(50, {ControllerMode::kCurrent, 1000});
  EXPECT_FALSE(bench.has(StatusFlag::kInitialized));
  EXPECT_FALSE(bench.joint.enabled);
  EXPECT_EQ(bench.get(1), 0);
  EXPECT_EQ(bench.get(10), 5) << "factory";
  EXPECT_EQ(bench.get(11), 1234) << "stored";
  EXPECT_EQ(bench.ask(drivers::tmcl::Command::kGetGlobalParameter, 16, 0, 2).value, 0);
}

TEST_P(EitherFirmware, TheHooksDoNotAllocateOrLock) {
  bench.start();
  std::array<std::uint8_t, 40> outputs{};
  std::array<std::uint8_t, 40> inputs{};
  const auto request = encode_mailbox(drivers::tmcl::Request{.type = 156});
  pack(DriveOutput{ControllerMode::kVelocity, 100}, outputs);
  const support::NoAllocGuard guard;
  for (int i = 0; i < 100; ++i) {
    bench.board.outputs_changed(outputs);
    bench.board.mailbox_received(request);
    bench.board.advance(1ms);
    bench.board.inputs(inputs);
  }
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace tmcm_board_test
}  // namespace sim::bus::test
