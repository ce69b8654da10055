#include "drivers/haptic/force_dimension_setup.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/drivers/force_dimension_bench.h"

namespace drivers::haptic {
namespace force_dimension_setup_test {

using namespace std::chrono_literals;

struct ForceDimensionSetup : ForceDimensionBench {};

TEST_F(ForceDimensionSetup, FirstOmega6IsTakenRightBeforeLeft) {
  stand_in->control().reset(2);
  open();
  EXPECT_EQ(device->info().name, "omega.6, right-handed (serial 4711)");
  EXPECT_FALSE(device->info().left_handed);
  stand_in->script(0).type = 33;
  open();
  EXPECT_EQ(device->info().name, "omega.6, left-handed (serial 4712)");
  EXPECT_TRUE(device->info().left_handed);
}

TEST_F(ForceDimensionSetup, SerialGoesBeforeNumber) {
  stand_in->control().reset(2);
  config.index = std::uint8_t{0};
  config.serial = std::uint16_t{4712};
  open();
  EXPECT_EQ(device->info().serial, 4712);
  config.serial.reset();
  open();
  EXPECT_EQ(device->info().serial, 4711);
}

TEST_F(ForceDimensionSetup, OtherTypesAreRefusedAndClosedAgain) {
  script().type = 33;
  config.index = std::uint8_t{0};
  EXPECT_PRED2(says, refusal(), "expected omega.6 (34 or 36), found omega.3 (type 33)");
  EXPECT_FALSE(state().open);
}

TEST_F(ForceDimensionSetup, NoDeviceHeldDeviceAndWrongSerialAreToldApart) {
  config.serial = std::uint16_t{1};
  EXPECT_PRED2(says, refusal(), "open serial 1");
  EXPECT_PRED2(says, refusal(), "name another device");
  config.serial.reset();
  script().held_by_other = true;
  EXPECT_PRED2(says, refusal(), "1 connected, 0 available");
  EXPECT_PRED2(says, refusal(), "another program has it open");
  config.serial = std::uint16_t{4711};
  EXPECT_PRED2(says, refusal(), "found the device is in use (SDK error 20)");
  script().connected = false;
  EXPECT_PRED2(says, refusal(), "connect its USB cable");
}

TEST_F(ForceDimensionSetup, NoConnectionNoPowerAndADeviceErrorAreRefused) {
  script().status_says_not_connected = true;
  EXPECT_PRED2(says, refusal(), "not connected");
  script().status_says_not_connected = false;
  script().powered = false;
  EXPECT_PRED2(says, refusal(), "no power");
  script().powered = true;
  script().error = 3;
  EXPECT_PRED2(says, refusal(), "error 3");
  EXPECT_FALSE(state().open);
}

TEST_F(ForceDimensionSetup, UncalibratedDeviceIsRefusedUntilMotionIsAllowed) {
  script().calibrated = false;
  EXPECT_PRED2(says, refusal(), "allow_motion");
  EXPECT_EQ(state().calibrations, 0) << "nothing moved";
  EXPECT_FALSE(state().open);
  config.allow_motion = true;
  open();
  EXPECT_EQ(state().calibrations, 1);
  EXPECT_FALSE(state().regulation) << "handed back";
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
}

TEST_F(ForceDimensionSetup, StatusAndLibdrdHaveToAgreeOnTheCalibration) {
  script().status_says_reset = true;
  EXPECT_PRED2(says, refusal(), "allow_motion");
  script().status_says_reset = false;
  script().drd_agrees = false;
  EXPECT_PRED2(says, refusal(), "allow_motion");
}

TEST_F(ForceDimensionSetup, WristThatIsNotCalibratedIsAWarning) {
  script().wrist_calibrated = false;
  open();
  EXPECT_TRUE(warned("the wrist is not calibrated"));
}

TEST_F(ForceDimensionSetup, ForceOfTheCalibrationDoesNotWaitBehindTheBrakes) {
  config.allow_motion = true;
  script().calibrated = false;
  script().refuses_force_when_braked = true;
  open();
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
  EXPECT_EQ(norm(state().command_N), 0.0);
}

TEST_F(ForceDimensionSetup, LibdrdIsHandedTheDeviceAndClosesIt) {
  open();
  EXPECT_TRUE(state().opened_by_drd);
  device.reset();
  EXPECT_FALSE(state().open);
}

TEST_F(ForceDimensionSetup, LibraryWithHalfOfLibdrdsPairIsUsedWithoutIt) {
  for (const char* missing : {"drdOpenID", "drdClose"}) {
    load({missing});
    start();
    EXPECT_FALSE(state().opened_by_drd);
    device.reset();
    EXPECT_FALSE(state().open);

    config.allow_motion = true;
    script().calibrated = false;
    EXPECT_PRED2(says, refusal(), std::string("without ") + missing + " (");
    EXPECT_EQ(state().calibrations, 0);
    EXPECT_FALSE(state().open);
  }
}

TEST_F(ForceDimensionSetup, DeviceThatLibdrdDoesNotTakeOrMistakesIsRefusedAndClosed) {
  calls().failing = 2;
  EXPECT_PRED2(says, refusal(),
               "hand it to libdrd, which calibrates: expected device 0, found time-out (SDK error 7)");
  EXPECT_FALSE(state().open);
  stand_in->control().reset(2);
  script().drd_counts_otherwise = true;
  EXPECT_PRED2(says, refusal(), "expected device 0, found device 1");
  EXPECT_FALSE(stand_in->state(0).open);
  EXPECT_FALSE(stand_in->state(1).open);
}

TEST_F(ForceDimensionSetup, CalibrationThatFailsOrDoesNotTakeIsRefused) {
  config.allow_motion = true;
  script().calibrated = false;
  script().calibration_fails = true;
  EXPECT_PRED2(says, refusal(), "calibrate by moving the handle: expected success, found time-out");
  script().calibration_fails = false;
  script().drd_agrees = false;
  EXPECT_PRED2(says, refusal(), "none after calibration");
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
}

TEST_F(ForceDimensionSetup, CalibrationThatFailsHalfWayLeavesNoRegulation) {
  config.allow_motion = true;
  script().calibrated = false;
  script().calibration_fails_half_way = true;
  EXPECT_PRED2(says, refusal(), "calibrate by moving the handle: expected success, found time-out");
  EXPECT_EQ(state().calibrations, 1);
  EXPECT_FALSE(state().regulation);
  EXPECT_NE(state().mode, ForceDimensionMode::kForce);

  script().calibration_fails_half_way = false;
  script().failing_drd_stops = 1;
  EXPECT_PRED2(says, refusal(), "take over from calibration: expected success, found time-out");
  EXPECT_EQ(state().calibrations, 2);
  EXPECT_FALSE(state().regulation);
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
}

TEST_F(ForceDimensionSetup, RegulationThatDoesNotStopIsToldSoAgainAndAgainAndTheOperatorIsWarned) {
  config.allow_motion = true;
  for (const bool half_way : {true, false}) {
    const int first = half_way ? 0 : 1;  // the attempt to take over
    stand_in->control().reset(1);
    script().calibrated = false;
    script().calibration_fails_half_way = half_way;
    script().failing_drd_stops = first + 4;
    const nanoseconds begin = now;
    EXPECT_FALSE(says(refusal(), "may still be driving"));
    EXPECT_FALSE(state().regulation);
    EXPECT_EQ(now - begin, 4 * 2ms);

    stand_in->control().reset(1);
    script().calibrated = false;
    script().calibration_fails_half_way = half_way;
    script().failing_drd_stops = first + 5;
    EXPECT_PRED2(says, refusal(), "the SDK may still be driving the handle: switch the device off");
    EXPECT_TRUE(state().regulation);
    EXPECT_EQ(script().failing_drd_stops, 0) << "five times";
    EXPECT_FALSE(state().open);
  }
}

TEST_F(ForceDimensionSetup, AnyCallThatFailsRefusesOrLeavesEveryLimitSetAndTheForceOff) {
  config.allow_motion = true;
  config.effector_mass_kg = 0.2;
  config.time_guard = 0us;
  for (const bool calibrated : {true, false}) {
    for (const bool works : {false, true}) {
      int refused = 0;
      for (int call = 1;; ++call) {
        SCOPED_TRACE(call);
        device.reset();
        stand_in->control().reset(1);
        script().calibrated = calibrated;
        script().time_guard_us = 5000;
        calls().failing = call;
        calls().failing_works = works;
        const bool opened = says(refusal(), "opened");
        if (calls().made < call) break;               // none is left to fail
        const bool id_was_lost = works && call == 1;  // lost with the answer to opening: the device cannot be
                                                      // closed
        EXPECT_EQ(state().open, opened || id_was_lost);
        EXPECT_FALSE(state().regulation);
        EXPECT_NE(state().mode, ForceDimensionMode::kForce);
        if (!opened) {
          ++refused;
          continue;
        }
        EXPECT_EQ(state().watchdog_ticks, 160);
        EXPECT_EQ(state().max_force_N, 8.0);
        EXPECT_EQ(state().effector_mass_kg, 0.2);
        EXPECT_TRUE(state().gravity_compensation);
        calls().failing = 0;
        run(3ms, kOff);
        EXPECT_TRUE(status.fresh) << "the time guard";
      }
      EXPECT_GE(refused, 12);
    }
  }
}

TEST_F(ForceDimensionSetup, CalibratedDeviceDoesNotMoveThoughItMight) {
  config.allow_motion = true;
  open();
  EXPECT_EQ(state().calibrations, 0);
}

TEST_F(ForceDimensionSetup, SetUpLeavesLimitsSetThresholdUntouchedAndForceOff) {
  config.effector_mass_kg = 0.2;
  open();
  EXPECT_EQ(state().watchdog_ticks, 160);
  EXPECT_EQ(device->info().watchdog_ticks, 160);
  EXPECT_EQ(state().max_force_N, 8.0);
  EXPECT_EQ(state().effector_mass_kg, 0.2);
  EXPECT_TRUE(state().gravity_compensation);
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
  EXPECT_EQ(device->info().velocity_threshold, 1500U);
  EXPECT_EQ(device->info().firmware, 3.2);
  EXPECT_EQ(state().velocity_threshold_writes, 0);
  EXPECT_FALSE(state().expert) << "expert mode is left again";
  EXPECT_TRUE(device->info().warnings.empty());
}

TEST_F(ForceDimensionSetup, StoredEffectorMassStaysUnlessConfigured) {
  script().effector_mass_kg = 0.31;
  open();
  EXPECT_EQ(state().effector_mass_kg, 0.31);
}

TEST_F(ForceDimensionSetup, AFirmwareThatIsNoVersionDoesNotSpareTheWatchdog) {
  for (const double firmware : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    script().firmware = firmware;
    open();
    EXPECT_FALSE(device->info().firmware.has_value());
    EXPECT_EQ(device->info().watchdog_ticks, 160);
    EXPECT_EQ(state().watchdog_ticks, 160);
  }
}

TEST_F(ForceDimensionSetup, FirmwareThatCannotBeToldHasToTakeTheWatchdog) {
  load({"dhdGetVersion"});
  script().firmware = 2.4;
  EXPECT_PRED2(says, refusal(),
               "set the watchdog to 160 ticks of 125 us: expected success, found not implemented");
  EXPECT_FALSE(state().expert) << "expert mode is left also when thrown through";
  EXPECT_FALSE(state().open);
}

TEST_F(ForceDimensionSetup, WatchdogThatReadsBackOtherwiseIsRefused) {
  script().watchdog_reads_back = 159;
  EXPECT_PRED2(says, refusal(), "set the watchdog to 160 ticks of 125 us: expected 160, found 159");
}

TEST_F(ForceDimensionSetup, FirmwareThreeIsTheFirstWithAWatchdog) {
  script().firmware = 3.0;
  open();
  EXPECT_EQ(state().watchdog_ticks, 160);
}

TEST_F(ForceDimensionSetup, OldFirmwareIsTakenWithAWarningInPlaceOfAWatchdog) {
  script().firmware = 2.4;
  open();
  EXPECT_EQ(device->info().watchdog_ticks, 0);
  EXPECT_TRUE(warned("firmware 2.4 has no watchdog"));
}

TEST_F(ForceDimensionSetup, VelocityThresholdThatSomebodySwitchedOffIsToldAndStays) {
  script().velocity_threshold_mm_per_s = 0;
  open();
  EXPECT_TRUE(warned("velocity threshold off"));
  EXPECT_EQ(state().velocity_threshold_writes, 0);
}

TEST_F(ForceDimensionSetup, ConfigurationIsRefusedWithAllThatIsWrong) {
  config.watchdog = 0us;
  config.max_force_N = 12.5;
  config.settle = 19ms;
  config.effector_mass_kg = std::numeric_limits<double>::quiet_NaN();
  const std::string said = refusal();
  EXPECT_PRED2(says, said, "watchdog: 125 us to 31.875 ms, and never off");
  EXPECT_PRED2(says, said, "max_force_N: above 0 and up to 12 N");
  EXPECT_PRED2(says, said, "settle: 20 ms to 10 s");
  EXPECT_PRED2(says, said, "effector_mass_kg: 0 to 1 kg");
}

TEST(ForceDimensionConfig, WatchdogHoldsEightBitsOfTicks) {
  ForceDimensionConfig config;
  const auto fits = [&config](std::chrono::microseconds watchdog) {
    config.watchdog = watchdog;
    return config.problems().empty();
  };
  EXPECT_FALSE(fits(124us));
  EXPECT_TRUE(fits(125us));
  EXPECT_EQ(config.watchdog_ticks(), 1);
  EXPECT_TRUE(fits(31'875us));
  EXPECT_EQ(config.watchdog_ticks(), 255);
  EXPECT_FALSE(fits(32'000us));
  EXPECT_FALSE(fits(-125us));
}

TEST(ForceDimensionConfig, EachBoundHoldsAtItsEdge) {
  const auto problems_with = [](auto change) {
    ForceDimensionConfig config;
    config.watchdog = 10ms;
    change(config);
    return config.problems();
  };
  const auto expect_edge = [&](auto member, auto inside, auto outside, const char* named) {
    EXPECT_TRUE(problems_with([&](auto& config) { config.*member = inside; }).empty()) << named;
    const auto problems = problems_with([&](auto& config) { config.*member = outside; });
    ASSERT_EQ(problems.size(), 1U) << named;
    EXPECT_PRED2(says, problems[0], named);
  };
  using Config = ForceDimensionConfig;
  expect_edge(&Config::max_force_N, 0.001, 0.0, "max_force_N");
  expect_edge(&Config::max_force_N, 12.0, 12.001, "max_force_N");
  expect_edge(&Config::effector_mass_kg, 0.0, -0.001, "effector_mass_kg");
  expect_edge(&Config::effector_mass_kg, 1.0, 1.001, "effector_mass_kg");
  expect_edge(&Config::time_guard, 0us, -1us, "time_guard");
  expect_edge(&Config::time_guard, 10ms, 10'001us, "time_guard");
  expect_edge(&Config::settle, 20ms, 19ms, "settle");
  expect_edge(&Config::settle, 10s, 10'001ms, "settle");
  expect_edge(&Config::index, std::uint8_t{127}, std::uint8_t{128}, "index");
  expect_edge(&Config::wait, WaitFor(sleep_for), WaitFor(), "wait");
}

// One symbol each: LeakSanitizer does not survive dozens of loaded copies of the library in one process.
struct NeededSymbol : ForceDimensionBench, testing::WithParamInterface<const char*> {};
struct SparedSymbol : ForceDimensionBench, testing::WithParamInterface<const char*> {};

TEST_P(NeededSymbol, RefusesByNameWhenItIsMissing) {
  load({GetParam()});
  EXPECT_PRED2(says, refusal(), std::string("without ") + GetParam() + " (");
  device.reset();
  EXPECT_FALSE(state().open);
}

TEST_P(SparedSymbol, IsAWarningWhenItIsMissing) {
  load({GetParam()});
  start();
  EXPECT_TRUE(warned(std::string("no ") + GetParam()));
  device.reset();
  EXPECT_EQ(state().mode, ForceDimensionMode::kBrake);
}

const auto name_of_symbol = [](const auto& symbol) { return std::string(symbol.param); };

INSTANTIATE_TEST_SUITE_P(ForceDimension, NeededSymbol,
                         testing::Values("dhdGetSystemType", "dhdOpenType", "dhdClose", "dhdGetStatus",
                                         "dhdEnableForce", "dhdStop", "dhdSetForce", "dhdSetMaxForce",
                                         "dhdSetGravityCompensation", "dhdSetWatchdog", "dhdEnableExpertMode",
                                         "dhdDisableExpertMode"),
                         name_of_symbol);

INSTANTIATE_TEST_SUITE_P(ForceDimension, SparedSymbol,
                         testing::Values("dhdErrorGetLast", "dhdGetDeviceCount", "dhdGetAvailableCount",
                                         "dhdGetSerialNumber", "dhdGetVersion", "dhdOpenID", "dhdOpenSerial",
                                         "dhdGetButtonMask", "dhdGetButton", "dhdGetPosition",
                                         "dhdGetOrientationFrame", "dhdGetPositionAndOrientationFrame",
                                         "dhdSetEffectorMass", "drdOpenID", "drdClose", "drdIsInitialized",
                                         "drdAutoInit", "drdStop", "dhdGetWatchdog",
                                         "dhdGetVelocityThreshold", "dhdSetTimeGuard"),
                         name_of_symbol);

TEST_F(ForceDimensionSetup, MissingSymbolsOfAConfiguredFeatureRefuse) {
  load({"dhdOpenSerial", "dhdOpenID", "dhdSetTimeGuard", "dhdSetEffectorMass", "drdAutoInit"});
  config.serial = std::uint16_t{4711};
  EXPECT_PRED2(says, refusal(), "dhdOpenSerial");
  config.serial.reset();
  config.index = std::uint8_t{0};
  EXPECT_PRED2(says, refusal(), "dhdOpenID");
  config.index.reset();
  config.time_guard = 0us;
  EXPECT_PRED2(says, refusal(), "dhdSetTimeGuard");
  config.time_guard.reset();
  config.effector_mass_kg = 0.1;
  EXPECT_PRED2(says, refusal(), "dhdSetEffectorMass");
  config.effector_mass_kg.reset();
  config.allow_motion = true;
  script().calibrated = false;
  EXPECT_PRED2(says, refusal(), "drdAutoInit (calibrating by moving the handle)");
  load({"dhdGetPositionAndOrientationFrame", "dhdGetPosition"});
  EXPECT_PRED2(says, refusal(), "dhdGetPosition (");
}

}  // namespace force_dimension_setup_test
}  // namespace drivers::haptic
