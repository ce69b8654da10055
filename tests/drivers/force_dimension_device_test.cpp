// Against the stand-in for the vendor's library, in virtual time: one exchange per millisecond.
#include "drivers/haptic/force_dimension.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <thread>

#include "tests/drivers/force_dimension_bench.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::haptic {
namespace force_dimension_device_test {

using namespace std::chrono_literals;

struct ForceDimensionDevice : ForceDimensionBench {};

// ---- pose and buttons

TEST_F(ForceDimensionDevice, PoseAndButtonsComeInTheBaseFrameByEitherWayOfReading) {
  for (const bool in_two_calls : {false, true}) {
    if (in_two_calls) load({"dhdGetPositionAndOrientationFrame", "dhdGetButtonMask"});
    script().hand_holds = true;
    script().hand_m = {0.02, -0.03, 0.01};
    script().wrist_rad = {0.0, 0.5, 0.0};
    script().buttons = 1;
    open();
    ASSERT_TRUE(run(3s, kHold).ok());
    EXPECT_TRUE(status.fresh);
    for (std::size_t i = 0; i < 3; ++i) {
      // Coulomb friction of 0.15 N on the hand's 300 N/m, and one step of the sensor.
      EXPECT_NEAR(sample.p_HD_m[i], script().hand_m[i], 0.15 / 300.0 + 1e-5);
    }
    // The tilt of the wrist's own frame is about y, as the turn: it cancels.
    EXPECT_NEAR(sample.R_HD[0][2], std::sin(0.5), 0.09 * 3.15 / 180.0);
    EXPECT_NEAR(sample.R_HD[2][0], -std::sin(0.5), 0.09 * 3.15 / 180.0);
    EXPECT_NEAR(sample.R_HD[1][1], 1.0, 1e-12);
    EXPECT_EQ(sample.buttons, 1U);
    script().buttons = 0;
    ASSERT_TRUE(cycle(kHold).ok());
    EXPECT_EQ(sample.buttons, 0U);
    device.reset();
  }
}

TEST_F(ForceDimensionDevice, PoseIsReadWithTheForceOff) {
  open();
  ASSERT_TRUE(run(100ms, kOff).ok());
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
  EXPECT_LT(sample.p_HD_m[2], 0.0) << "the braked handle sinks";
}

TEST_F(ForceDimensionDevice, TimeGuardRepeatsAPoseWhichIsNotFresh) {
  for (const bool in_two_calls : {false, true}) {
    if (in_two_calls) load({"dhdGetPositionAndOrientationFrame"});
    script().time_guard_us = 1500;
    open();
    for (const bool fresh : {true, false, true}) {
      ASSERT_TRUE(cycle(kHold).ok());
      EXPECT_EQ(status.fresh, fresh);
    }
    device.reset();
  }
}

TEST_F(ForceDimensionDevice, ConfiguredTimeGuardIsSet) {
  script().time_guard_us = 1500;
  config.time_guard = 0us;
  open();
  run(5ms, kHold);
  EXPECT_TRUE(status.fresh);
}

// ---- force

TEST_F(ForceDimensionDevice, ForceIsWithheldWhileTheDeviceSettles) {
  script().hand_holds = true;
  open();
  for (const nanoseconds end = now + config.settle; now < end;) {
    ASSERT_TRUE(cycle(push(4.0)).ok()) << words();
    ASSERT_TRUE(status.withheld && status.fresh);
    ASSERT_EQ(norm(state().command_N), 0.0);
  }
  ASSERT_TRUE(cycle(push(4.0)).ok());
  EXPECT_FALSE(status.withheld);
  EXPECT_EQ(state().command_N[0], 4.0);
  EXPECT_EQ(status.f_D_H_N[0], 4.0);
}

TEST_F(ForceDimensionDevice, DisablingIsZeroAtOnceAndKeepsTheBrakesOff) {
  script().hand_holds = true;
  start(push(4.0));
  ASSERT_TRUE(run(kWatchdog, push(4.0)).ok());
  EXPECT_NEAR(felt_N(), 4.0, 1e-3) << "the motors follow within milliseconds";
  ASSERT_TRUE(cycle({.enable = false, .f_D_H_N = {4.0, 0.0, 0.0}}).ok());
  EXPECT_EQ(norm(state().command_N), 0.0);
  EXPECT_EQ(state().mode, ForceDimensionMode::kForce) << "still carries its weight";
  ASSERT_TRUE(cycle(push(4.0)).ok());
  EXPECT_FALSE(status.withheld) << "no brakes to wait for";
  EXPECT_EQ(state().command_N[0], 4.0);
}

TEST_F(ForceDimensionDevice, ZeroForceIsSentInEveryCycleSoTheHandleDoesNotSag) {
  start();
  const double height_m = state().position_m[2];
  const long calls = state().force_calls;
  ASSERT_TRUE(run(2s, kHold).ok());
  ASSERT_TRUE(run(2s, kOff).ok());
  EXPECT_EQ(state().force_calls, calls + 4000);
  EXPECT_EQ(state().mode, ForceDimensionMode::kForce);
  EXPECT_NEAR(state().position_m[2], height_m, 1e-5);
}

TEST_F(ForceDimensionDevice, LargeForcesAreScaledDownKeepingTheirDirection) {
  script().hand_holds = true;
  start(push(30.0, 0.0, 40.0));
  EXPECT_TRUE(status.saturated);
  EXPECT_NEAR(state().command_N[0], 4.8, 1e-9);
  EXPECT_NEAR(state().command_N[2], 6.4, 1e-9);
  ASSERT_TRUE(run(10ms, push(1e308, 1e308, 1e308)).ok());
  EXPECT_TRUE(status.saturated);
  EXPECT_LE(norm(state().command_N), 8.0);
  ASSERT_TRUE(run(10ms, push(3.0)).ok());
  EXPECT_FALSE(status.saturated);
}

TEST_F(ForceDimensionDevice, MotorSaturationOfTheDeviceIsAnEvent) {
  config.max_force_N = 12.0;
  script().hand_holds = true;
  // 11 N and the handle's weight are more than the motors' 12 N.
  start(push(0.0, 0.0, 11.0));
  EXPECT_TRUE(status.ok());
  EXPECT_TRUE(status.saturated);
}

TEST_F(ForceDimensionDevice, ForceWithTheBrakesOnMayBeRefusedOrNotAndAnOldStatusIsWaitedFor) {
  script().refuses_force_when_braked = true;
  script().status_delay_s = 0.005;
  start(push(1.0));
  EXPECT_EQ(state().command_N[0], 1.0);
  // On and off again sooner than a status takes.
  run(1ms, kOff);
  run(1ms, push(1.0));
  run(50ms, kOff);
  EXPECT_EQ(faults, 0);
}

// ---- faults

TEST_F(ForceDimensionDevice, CommandThatIsNotFiniteIsZeroForce) {
  script().hand_holds = true;
  start(push(4.0));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(cycle(push(0.0, bad)).fault, Fault::kBadCommand);
    EXPECT_EQ(norm(state().command_N), 0.0);
    EXPECT_EQ(status.f_D_H_N, kZero_N);
    EXPECT_TRUE(cycle(push(4.0)).ok());
  }
}

TEST_F(ForceDimensionDevice, SampleWithAnyValueNotFiniteIsZeroForceAndNotHandedOut) {
  script().hand_holds = true;
  start(push(4.0));
  for (int value = 0; value < 12; ++value) {
    SCOPED_TRACE(value);
    ASSERT_TRUE(cycle(push(4.0)).ok());
    ASSERT_EQ(state().command_N[0], 4.0);
    script().pose_is_nan = true;
    script().nan_value = value;
    EXPECT_EQ(cycle(push(4.0)).fault, Fault::kBadSample);
    EXPECT_FALSE(status.fresh);
    EXPECT_TRUE(is_finite(sample.p_HD_m) && std::ranges::all_of(sample.R_HD, is_finite));
    EXPECT_EQ(norm(state().command_N), 0.0);
    EXPECT_EQ(cycle(kOff).fault, Fault::kBadSample) << "it is still so";
    script().pose_is_nan = false;
  }
}

TEST_F(ForceDimensionDevice, NegativeResultIsAFaultWithItsCode) {
  start(push(1.0));
  script().failing_poses = 1;
  EXPECT_EQ(cycle(push(1.0)).fault, Fault::kDeviceFault);
  EXPECT_EQ(status.detail, 7);
  EXPECT_EQ(words(), "the SDK refused a call: time-out (SDK error 7)");
  EXPECT_EQ(norm(state().command_N), 0.0);
  run(1ms, kOff);
  script().failing_forces = 2;  // the zero before the force is on, which may be refused, and the next
  script().failing_code = 8;
  EXPECT_EQ(run(1ms, push(1.0)).detail, 8);
  EXPECT_EQ(run(1ms, push(1.0)).detail, 8) << "kept until disabled";
  EXPECT_TRUE(cycle(kOff).ok());
}

// The buttons' calls cannot report failures, and are excluded.
TEST_F(ForceDimensionDevice, AnyCallOfACycleThatFailsIsAFaultAndZeroForce) {
  for (const bool in_two_calls : {false, true}) {
    for (const bool works : {false, true}) {
      std::vector<std::string> without{"dhdGetButtonMask", "dhdGetButton"};
      if (in_two_calls) without.emplace_back("dhdGetPositionAndOrientationFrame");
      load(without);
      script().firmware = 2.4;  // nothing but the driver ends the force
      script().hand_holds = true;
      const int in_a_cycle = in_two_calls ? 4 : 3;
      for (int call = 1; call <= in_a_cycle; ++call) {
        SCOPED_TRACE(call);
        start(push(6.0));
        const long before = calls().made;
        ASSERT_TRUE(cycle(push(6.0)).ok());
        ASSERT_EQ(calls().made - before, in_a_cycle);
        calls().failing = calls().made + call;
        calls().failing_works = works;
        EXPECT_EQ(cycle(push(6.0)).fault, Fault::kDeviceFault);
        EXPECT_EQ(status.detail, 7);
        EXPECT_EQ(norm(state().command_N), 0.0);
        EXPECT_EQ(status.f_D_H_N, kZero_N);
        EXPECT_EQ(run(5ms, push(6.0)).fault, Fault::kDeviceFault);
        EXPECT_LT(felt_N(), 0.01);
      }
      device.reset();
    }
  }
}

TEST_F(ForceDimensionDevice, AnyCallOfEnablingThatFailsLeavesTheForceOffOrAtZero) {
  for (const bool works : {false, true}) {
    load({"dhdGetButtonMask", "dhdGetButton"});
    int refused = 0;
    for (int call = 1; call <= 5; ++call) {  // status, pose, zero, enable, force
      SCOPED_TRACE(call);
      open();
      ASSERT_TRUE(run(5ms, kOff).ok());
      calls().failing = calls().made + call;
      calls().failing_works = works;
      cycle(push(6.0));
      EXPECT_GE(calls().made, calls().failing);
      EXPECT_EQ(norm(state().command_N), 0.0);
      EXPECT_EQ(state().mode == ForceDimensionMode::kForce, status.ok());
      if (!status.ok()) ++refused;
    }
    EXPECT_EQ(refused, 4) << "a zero may be refused with the brakes on";
    device.reset();
  }
}

TEST_F(ForceDimensionDevice, DeviceThatRefusesToEnableIsAFault) {
  open();
  script().refuses_to_enable = true;
  EXPECT_EQ(cycle(push(1.0)).fault, Fault::kDeviceFault);
  EXPECT_EQ(status.detail, 12);
  script().refuses_to_enable = false;
  EXPECT_FALSE(cycle(push(1.0)).ok()) << "kept until disabled";
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
  EXPECT_TRUE(cycle(kOff).ok());
  EXPECT_TRUE(cycle(push(1.0)).ok());
  EXPECT_EQ(state().mode, ForceDimensionMode::kForce);
}

TEST_F(ForceDimensionDevice, MissedCyclesBrakeWithinTheWatchdogAndNeedADisable) {
  script().hand_holds = true;
  start(push(6.0));
  pass(kWatchdog);  // with the millisecond of the last cycle: one watchdog period and 1 ms
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
  EXPECT_EQ(norm(state().motor_N), 0.0);
  EXPECT_EQ(cycle(push(6.0)).fault, Fault::kForceOff);
  EXPECT_EQ(status.detail, kForceOffWatchdog);
  EXPECT_PRED2(says, words(), "watchdog");
  EXPECT_EQ(run(500ms, push(6.0)).fault, Fault::kForceOff);
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake) << "does not come back by itself";
  EXPECT_TRUE(run(5ms, kOff).ok());
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
  EXPECT_TRUE(run(kUntilFullForce, push(6.0)).ok());
  EXPECT_EQ(state().command_N[0], 6.0);
}

TEST_F(ForceDimensionDevice, TimeThatRanBackwardsWhileDisabledHidesNoBrakes) {
  script().hand_holds = true;
  start(push(6.0));
  ASSERT_TRUE(run(5ms, kOff).ok());
  now -= 5s;
  ASSERT_TRUE(run(2ms, kOff).ok());
  ASSERT_TRUE(run(kUntilFullForce, push(6.0)).ok());
  script().status_says_braked = true;
  EXPECT_EQ(cycle(push(6.0)).fault, Fault::kForceOff);
}

TEST_F(ForceDimensionDevice, PausesWithTheForceOffAreNoFault) {
  open();
  pass(10s);
  EXPECT_TRUE(cycle(kOff).ok());
  pass(10s);
  EXPECT_TRUE(cycle(kOff).ok());
}

TEST_F(ForceDimensionDevice, CallsThatTakeTooLongEndInTheFirmwaresBrakes) {
  script().hand_holds = true;
  start(push(6.0));
  calls().cost_s = 0.006;  // four calls in a cycle: past the watchdog's time
  cycle(push(6.0));
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
  EXPECT_FALSE(cycle(push(6.0)).ok());
  EXPECT_EQ(norm(state().command_N), 0.0);
}

TEST_F(ForceDimensionDevice, CallThatDoesNotReturnEndsInTheFirmwaresWatchdog) {
  script().hand_holds = true;
  start(push(6.0));
  stand_in->control().hold(true);
  std::thread loop([this] { status = device->exchange(push(6.0), now, sample); });
  const auto deadline = std::chrono::steady_clock::now() + 30s;
  while (stand_in->control().held() == 0 && std::chrono::steady_clock::now() < deadline)
    std::this_thread::yield();
  EXPECT_EQ(stand_in->control().held(), 1);
  EXPECT_EQ(state().mode, ForceDimensionMode::kForce);
  pass(kWatchdog);
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
  EXPECT_EQ(norm(state().motor_N), 0.0);
  stand_in->control().hold(false);
  loop.join();
  EXPECT_EQ(status.fault, Fault::kForceOff);
  EXPECT_EQ(status.detail, kForceOffWatchdog);
  EXPECT_EQ(norm(state().command_N), 0.0);
}

TEST_F(ForceDimensionDevice, PushingFastBrakesByVelocityWithBoundedForce) {
  script().hand_holds = true;
  start(push(3.0));
  script().hand_N = {60.0, 0.0, 0.0};
  script().hand_holds = false;
  ASSERT_TRUE(faults_within(200ms, push(3.0)));
  EXPECT_EQ(status.fault, Fault::kForceOff);
  EXPECT_EQ(status.detail, kForceOffVelocity);
  EXPECT_EQ(norm(state().motor_N), 0.0);
  EXPECT_LE(state().largest_motor_N, 8.0);
}

TEST_F(ForceDimensionDevice, BrakesWhileSettlingShowAtItsEndAndNoForceCameMeanwhile) {
  open();
  script().hand_N = {60.0, 0.0, 0.0};
  cycle(push(8.0));
  ASSERT_TRUE(faults_within(config.settle, push(8.0)));
  EXPECT_EQ(status.detail, kForceOffVelocity);
  EXPECT_EQ(state().largest_motor_N, 0.0);
}

TEST_F(ForceDimensionDevice, LettingGoUnderAConstantForceEndsInTheBrakes) {
  script().hand_holds = true;
  start(push(8.0));
  script().hand_holds = false;
  nanoseconds fast{};
  bool braked = false;
  for (int i = 0; i < 500 && !braked; ++i) {
    if (fast == 0ns && norm(state().velocity_m_per_s) > 1.4) fast = now;
    braked = !cycle(push(8.0)).ok();
  }
  ASSERT_TRUE(braked);
  EXPECT_EQ(status.detail, kForceOffVelocity);
  EXPECT_LT(now - fast, kWatchdog);
  EXPECT_EQ(norm(state().motor_N), 0.0);
  EXPECT_LE(state().largest_motor_N, 8.0 + 1e-6);
}

TEST_F(ForceDimensionDevice, LettingGoInAVirtualWallComesToRestOutsideOfIt) {
  // A wall at x = 0 of 500 N/m, entered by 8 mm.
  script().hand_holds = true;
  script().hand_m = {-0.02, 0.0, 0.0};
  open();
  const auto wall = [this] { return push(std::max(0.0, -500.0 * sample.p_HD_m[0])); };
  for (int i = 0; i < 2000; ++i) ASSERT_TRUE(cycle(wall()).ok());
  EXPECT_GT(state().command_N[0], 3.0);
  script().hand_holds = false;
  for (int i = 0; i < 2000; ++i) {
    ASSERT_TRUE(cycle(wall()).ok()) << words();
    ASSERT_LE(norm(state().command_N), 8.0);
  }
  EXPECT_GE(sample.p_HD_m[0], -1e-4);
  EXPECT_LT(norm(state().command_N), 0.05);
}

TEST_F(ForceDimensionDevice, UnpluggedDeviceIsAFaultInTheSameCycleAndItsForceIsGone) {
  script().hand_holds = true;
  start(push(6.0));
  script().connected = false;
  EXPECT_EQ(cycle(push(6.0)).fault, Fault::kUnplugged);
  EXPECT_EQ(status.detail, kSdkErrorCommunication);
  EXPECT_PRED2(says, words(), "USB");
  pass(kWatchdog);
  EXPECT_EQ(norm(state().motor_N), 0.0);
  EXPECT_EQ(cycle(kOff).fault, Fault::kUnplugged) << "disabling does not bring it back";
  EXPECT_FALSE(device->stop()) << "not confirmed";
  EXPECT_FALSE(state().open);
}

TEST_F(ForceDimensionDevice, PowerThatGoesNeedsANewSetUpThoughItComesBack) {
  script().hand_holds = true;
  start(push(6.0));
  script().powered = false;
  EXPECT_EQ(cycle(push(6.0)).fault, Fault::kUnplugged);
  EXPECT_EQ(run(50ms, push(6.0)).fault, Fault::kUnplugged);
  script().powered = true;
  EXPECT_EQ(run(5ms, kOff).fault, Fault::kUnplugged);
  EXPECT_EQ(run(kUntilFullForce, push(6.0)).fault, Fault::kUnplugged);
  EXPECT_EQ(state().mode, ForceDimensionMode::kReset);
  EXPECT_FALSE(status.fresh) << "a pose without calibration is none";
  EXPECT_EQ(state().watchdog_ticks, 0);

  EXPECT_PRED2(says, refusal(), "calibrated");
  script().calibrated = true;  // by hand
  start(push(6.0));
  EXPECT_EQ(state().watchdog_ticks, 160);
}

TEST_F(ForceDimensionDevice, PowerThatWentBetweenTwoExchangesIsSeenAfterwards) {
  start(push(6.0));
  script().powered = false;
  pass(2ms);
  script().powered = true;
  EXPECT_EQ(cycle(push(6.0)).fault, Fault::kUnplugged);
  EXPECT_EQ(status.detail, kSdkErrorNotReady);
  EXPECT_PRED2(says, words(), "not ready");
  EXPECT_EQ(cycle(kOff).fault, Fault::kUnplugged);
}

TEST_F(ForceDimensionDevice, CableThatWasOutBetweenTwoExchangesNeedsANewSetUp) {
  start(push(6.0));
  script().connected = false;
  pass(2ms);
  script().connected = true;
  EXPECT_EQ(cycle(push(6.0)).fault, Fault::kUnplugged);
  EXPECT_EQ(cycle(kOff).fault, Fault::kUnplugged);
  start(push(6.0));  // although the status reports that cause until the force is on
}

TEST_F(ForceDimensionDevice, UnpluggedIsToldEvenAfterAnotherFault) {
  start(push(6.0));
  cycle(push(std::numeric_limits<double>::quiet_NaN()));
  ASSERT_EQ(status.fault, Fault::kBadCommand);
  script().powered = false;
  EXPECT_EQ(cycle(push(6.0)).fault, Fault::kUnplugged);
  script().powered = true;
  EXPECT_EQ(cycle(kOff).fault, Fault::kUnplugged);
}

TEST_F(ForceDimensionDevice, DeviceThatReportsAnErrorNeedsANewSetUp) {
  start(push(6.0));
  script().error = 3;
  EXPECT_EQ(cycle(push(6.0)).fault, Fault::kUnplugged);
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
  script().error = 0;
  EXPECT_EQ(run(5ms, kOff).fault, Fault::kUnplugged);
  start(push(6.0));
}

// Old firmware has no watchdog: nothing else would end the force.
TEST_F(ForceDimensionDevice, StatusThatIsWrongAboutTheDeviceLeavesNoForceBehindUntilANewSetUp) {
  using sim::devices::ForceDimensionScript;
  script().firmware = 2.4;
  script().hand_holds = true;
  for (bool ForceDimensionScript::*const wrong :
       {&ForceDimensionScript::status_says_no_power, &ForceDimensionScript::status_says_not_connected,
        &ForceDimensionScript::status_says_reset}) {
    start(push(6.0));
    script().*wrong = true;
    EXPECT_EQ(cycle(push(6.0)).fault, Fault::kUnplugged);
    EXPECT_EQ(norm(state().command_N), 0.0);
    EXPECT_EQ(status.f_D_H_N, kZero_N);
    EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
    pass(50ms);
    EXPECT_EQ(norm(state().motor_N), 0.0);
    script().*wrong = false;
    EXPECT_EQ(run(5ms, kOff).fault, Fault::kUnplugged);
    EXPECT_EQ(run(kUntilFullForce, push(6.0)).fault, Fault::kUnplugged);
    EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
  }
  start(push(6.0));
}

TEST_F(ForceDimensionDevice, StatusThatIsWrongAboutTheBrakesLeavesNoForceBehind) {
  script().firmware = 2.4;
  script().hand_holds = true;
  start(push(6.0));
  script().status_says_braked = true;
  EXPECT_EQ(cycle(push(6.0)).fault, Fault::kForceOff);
  EXPECT_EQ(norm(state().command_N), 0.0);
  EXPECT_EQ(status.f_D_H_N, kZero_N);
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
  script().status_says_braked = false;
  EXPECT_TRUE(cycle(kOff).ok());
  EXPECT_TRUE(run(kUntilFullForce, push(6.0)).ok());
}

TEST_F(ForceDimensionDevice, ZeroAndStopAreTriedInEachCycleUntilTheStopIsConfirmed) {
  script().firmware = 2.4;
  script().hand_holds = true;
  for (bool sim::devices::ForceDimensionScript::*const wrong :
       {&sim::devices::ForceDimensionScript::status_says_no_power,
        &sim::devices::ForceDimensionScript::status_says_braked}) {
    start(push(6.0));
    script().*wrong = true;
    script().failing_forces = 2;
    script().failing_stops = 3;
    EXPECT_FALSE(cycle(push(6.0)).ok());
    EXPECT_FALSE(cycle(push(6.0)).ok());
    EXPECT_EQ(state().command_N[0], 6.0) << "nothing went out";
    EXPECT_EQ(status.f_D_H_N[0], 6.0) << "and it is reported";
    EXPECT_FALSE(cycle(push(6.0)).ok());
    EXPECT_EQ(norm(state().command_N), 0.0);
    EXPECT_EQ(status.f_D_H_N, kZero_N);
    EXPECT_EQ(state().mode, ForceDimensionMode::kForce);
    EXPECT_FALSE(cycle(push(6.0)).ok());
    EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
    const long stops = state().stop_calls;
    run(5ms, push(6.0));
    EXPECT_EQ(state().stop_calls, stops) << "confirmed";
    script().*wrong = false;
  }
}

TEST_F(ForceDimensionDevice, ZeroThatIsRefusedIsFollowedByTheBrakes) {
  script().firmware = 2.4;
  script().hand_holds = true;
  for (const auto& command : {push(6.0), kOff, push(std::numeric_limits<double>::quiet_NaN())}) {
    start(push(6.0));
    script().failing_forces = 1'000'000;
    EXPECT_FALSE(cycle(command).ok());
    EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
    EXPECT_EQ(norm(state().motor_N), 0.0);
    EXPECT_EQ(status.f_D_H_N, kZero_N);
    script().failing_forces = 0;
    EXPECT_TRUE(cycle(kOff).ok()) << "nothing is wrong any more";
  }
}

TEST_F(ForceDimensionDevice, EnablingBringsNoOldForceBack) {
  script().hand_holds = true;
  start(push(6.0));
  script().status_says_braked = true;
  script().failing_forces = 1;
  cycle(push(6.0));
  ASSERT_EQ(state().mode, ForceDimensionMode::kBrake);
  ASSERT_EQ(state().command_N[0], 6.0) << "it waits behind the brakes";
  script().status_says_braked = false;
  ASSERT_TRUE(cycle(kOff).ok());
  ASSERT_TRUE(cycle(kHold).ok());
  ASSERT_EQ(state().mode, ForceDimensionMode::kForce);
  EXPECT_EQ(norm(state().brought_back_N), 0.0);
}

// ---- stop

TEST_F(ForceDimensionDevice, StopRampsDownWithinBoundsThenBrakesAndCloses) {
  script().hand_holds = true;
  start(push(6.0));
  const nanoseconds begin = now;
  double previous_N = 6.0;
  device.reset();
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
  EXPECT_LE(now - begin, 20ms);
  EXPECT_FALSE(state().open);

  faults = 0;
  config.wait = [&](nanoseconds time) {
    EXPECT_LT(state().command_N[0], previous_N);
    EXPECT_NEAR(previous_N - state().command_N[0], 0.6, 1e-9) << "even steps";
    previous_N = state().command_N[0];
    pass(time);
    EXPECT_EQ(state().mode, ForceDimensionMode::kForce) << "the watchdog is fed while ramping";
  };
  start(push(6.0));
  EXPECT_TRUE(device->stop());
  EXPECT_NEAR(previous_N, 0.6, 1e-9);
  EXPECT_EQ(device->exchange(push(1.0), now, sample).fault, Fault::kNotActive);
  EXPECT_TRUE(device->stop()) << "allowed again";
}

TEST_F(ForceDimensionDevice, StopTriesAgainButNotForEver) {
  open();
  script().failing_stops = 2;
  EXPECT_TRUE(device->stop());
  EXPECT_EQ(state().stop_calls, 3);
  open();
  script().failing_stops = 1000;
  EXPECT_FALSE(device->stop());
  EXPECT_EQ(state().stop_calls, 3 + 5);
  EXPECT_FALSE(state().open) << "closed all the same";
}

TEST_F(ForceDimensionDevice, StopSendsZeroInEachOfItsAttemptsWithPauses) {
  script().firmware = 2.4;
  script().hand_holds = true;
  start(push(6.0));
  script().failing_stops = 1000;
  script().failing_forces = 3;  // one of the ramp, two of the attempts
  const nanoseconds begin = now;
  EXPECT_FALSE(device->stop());
  EXPECT_EQ(now - begin, 4 * 2ms);
  EXPECT_EQ(state().mode, ForceDimensionMode::kForce) << "closing may leave it so";
  EXPECT_EQ(norm(state().command_N), 0.0);
}

TEST_F(ForceDimensionDevice, StopAfterAFaultOrARefusedStepOfItsRampIsAtOnce) {
  script().firmware = 2.4;
  script().hand_holds = true;
  start(push(6.0));
  script().failing_forces = 1;
  nanoseconds begin = now;
  EXPECT_TRUE(device->stop());
  EXPECT_EQ(now - begin, 0ns);

  start(push(6.0));
  script().failing_forces = 2;
  script().failing_stops = 1;
  EXPECT_FALSE(cycle(kOff).ok());
  ASSERT_EQ(state().command_N[0], 6.0) << "neither zero nor stop was taken";
  EXPECT_EQ(status.f_D_H_N[0], 6.0);
  begin = now;
  EXPECT_TRUE(device->stop());
  EXPECT_EQ(now - begin, 0ns);
}

TEST_F(ForceDimensionDevice, StopGoesOnWhenWaitingThrows) {
  script().hand_holds = true;
  config.wait = [](nanoseconds) { throw std::runtime_error("interrupted"); };
  start(push(6.0));
  EXPECT_TRUE(device->stop());
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
}

TEST_F(ForceDimensionDevice, ExchangeDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the guard is off under sanitizers";
  open();
  run(10ms, push(1.0));  // the stand-in's first call of a kind may set up its thread's error
  const support::NoAllocGuard guard;
  run(kUntilFullForce, push(30.0));
  cycle(push(std::numeric_limits<double>::quiet_NaN()));
  run(5ms, kOff);
  run(5ms, push(1.0));
  pass(50ms);
  run(5ms, push(1.0));
  run(5ms, kOff);
  run(5ms, push(1.0));
  script().connected = false;
  run(5ms, push(1.0));
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace force_dimension_device_test
}  // namespace drivers::haptic
