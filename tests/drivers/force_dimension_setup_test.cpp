#include "drivers/haptic/force_dimension_setup.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/drivers/force_dimension_bench.h"

namespace drivers::haptic {
namespace {

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

TEST_F(ForceDimensionSetup, NoPowerAndADeviceErrorAreRefused) {
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

TEST_F(ForceDimensionSetup, FirmwareThatCannotBeToldHasToTakeTheWatchdog) {
  load({"dhdGetVersion"});
  script().firmware = 2.4;
  EXPECT_PRED2(says, refusal(),
               "set the watchdog to 160 ticks of 125 us: expected success, found not implemented");
  EXPECT_FALSE(state().expert) << "expert mode is left also when thrown through";
  EXPECT_FALSE(state().open);
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
  config.ramp_in = 999ms;
  config.effector_mass_kg = std::numeric_limits<double>::quiet_NaN();
  const std::string said = refusal();
  EXPECT_PRED2(says, said, "watchdog: 125 us to 31.875 ms, and never off");
  EXPECT_PRED2(says, said, "max_force_N: above 0 and up to 12 N");
  EXPECT_PRED2(says, said, "ramp_in: 1 to 60 s");
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

TEST_F(ForceDimensionSetup, EveryMissingSymbolEitherRefusesByNameOrIsAWarning) {
  const ForceDimensionLibrary complete({.file = stand_in->path(), .sdk_folder = {}});
  for (const char* needed : {"dhdGetSystemType", "dhdOpenType", "dhdClose", "dhdGetStatus", "dhdEnableForce",
                             "dhdStop", "dhdSetForce", "dhdSetMaxForce", "dhdSetGravityCompensation",
                             "dhdSetWatchdog", "dhdEnableExpertMode", "dhdDisableExpertMode"}) {
    load({needed});
    EXPECT_PRED2(says, refusal(), std::string("without ") + needed + " (");
    device.reset();
    EXPECT_FALSE(state().open) << needed;
  }
  for (const char* spared :
       {"dhdErrorGetLast", "dhdGetDeviceCount", "dhdGetAvailableCount", "dhdGetSerialNumber", "dhdGetVersion",
        "dhdOpenID", "dhdOpenSerial", "dhdGetButtonMask", "dhdGetButton", "dhdGetPosition",
        "dhdGetOrientationFrame", "dhdGetPositionAndOrientationFrame", "dhdSetEffectorMass",
        "drdIsInitialized", "drdAutoInit", "drdStop", "dhdGetWatchdog", "dhdGetVelocityThreshold",
        "dhdSetTimeGuard"}) {
    load({spared});
    faults = 0;
    start();
    EXPECT_TRUE(warned(std::string("no ") + spared)) << spared;
    device.reset();
    EXPECT_EQ(state().mode, ForceDimensionMode::kBrake) << spared;
  }
}

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

}  // namespace
}  // namespace drivers::haptic
