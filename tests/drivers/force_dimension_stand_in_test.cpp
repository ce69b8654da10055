// The basis of the driver's tests, which they do not test themselves: the stand-in rejects what the vendor's
// library is documented to reject.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "drivers/haptic/force_dimension_library.h"
#include "tests/drivers/force_dimension_fakes.h"

namespace drivers::haptic {
namespace force_dimension_stand_in_test {

constexpr char kDefault = -1;

struct ForceDimensionStandIn : testing::Test {
  double height_m() const {
    double x_m = 0.0;
    double y_m = 0.0;
    double z_m = 0.0;
    EXPECT_EQ(f.get_position(&x_m, &y_m, &z_m, 0), 0);
    return z_m;
  }
  support::TemporaryDirectory folder;
  StandIn stand_in{folder, "library.so"};
  ForceDimensionLibrary library{SdkSearch{.file = stand_in.path(), .sdk_folder = {}}};
  const SdkFunctions& f = library.functions();
};

TEST_F(ForceDimensionStandIn, CallsBeforeOpeningFailAndTheDefaultDeviceIsTheLastOpened) {
  stand_in.control().reset(2);
  EXPECT_EQ(f.get_system_type(kDefault), -1);
  EXPECT_EQ(f.error_get_last(), kSdkErrorNoDevice);
  ASSERT_EQ(f.open_id(0), 0);
  ASSERT_EQ(f.open_type(kOmega6Left), 1);
  EXPECT_EQ(f.get_system_type(kDefault), kOmega6Left);
  EXPECT_EQ(f.get_system_type(0), kOmega6Right);
  EXPECT_EQ(f.close(kDefault), 0);
  EXPECT_EQ(f.get_system_type(1), -1);
}

TEST_F(ForceDimensionStandIn, DeviceHeldByAnotherProgramIsCountedAndNotAvailable) {
  stand_in.script().held_by_other = true;
  EXPECT_EQ(f.get_device_count(), 1);
  EXPECT_EQ(f.get_available_count(), 0);
  EXPECT_EQ(f.open_id(0), -1);
  EXPECT_EQ(f.error_get_last(), kSdkErrorDeviceInUse);
}

TEST_F(ForceDimensionStandIn, WatchdogNeedsExpertModeAndFirmwareThree) {
  ASSERT_EQ(f.open_id(0), 0);
  EXPECT_EQ(f.set_watchdog(160, 0), -1);
  EXPECT_EQ(f.error_get_last(), 9);
  f.enable_expert_mode();
  EXPECT_EQ(f.set_watchdog(160, 0), 0);
  stand_in.script().firmware = 2.9;
  EXPECT_EQ(f.set_watchdog(160, 0), -1);
  f.disable_expert_mode();
  std::uint32_t threshold = 0;
  EXPECT_EQ(f.get_velocity_threshold(&threshold, 0), -1);
}

TEST_F(ForceDimensionStandIn, NullPointersAndBadIndicesAreRefused) {
  ASSERT_EQ(f.open_id(0), 0);
  double x_m = 0.0;
  EXPECT_EQ(f.get_position(&x_m, nullptr, &x_m, 0), -1);
  EXPECT_EQ(f.error_get_last(), 17);
  EXPECT_EQ(f.get_status(nullptr, 0), -1);
  EXPECT_EQ(f.get_button(32, 0), -1);
  EXPECT_EQ(f.error_get_last(), 15);
}

TEST_F(ForceDimensionStandIn, LastErrorIsTheThreadsOwn) {
  EXPECT_EQ(f.open_id(7), -1);
  int elsewhere = -1;
  std::thread([&] { elsewhere = f.error_get_last(); }).join();
  EXPECT_EQ(elsewhere, 0);
  EXPECT_EQ(f.error_get_last(), kSdkErrorNoDevice);
}

TEST_F(ForceDimensionStandIn, PositionIsConstantUntilCalibratedAndThenInSteps) {
  stand_in.control().reset(1);
  stand_in.script().calibrated = false;
  ASSERT_EQ(f.open_id(0), 0);
  EXPECT_FALSE(f.drd_is_initialized(0));
  EXPECT_EQ(f.enable_force(1, 0), -1) << "not without calibration";
  EXPECT_EQ(height_m(), 0.0);
  stand_in.control().advance(0.1);
  EXPECT_NE(stand_in.state().position_m[2], 0.0);
  EXPECT_EQ(height_m(), 0.0);

  ASSERT_EQ(f.drd_open_id(0), 0);
  ASSERT_EQ(f.drd_auto_init(0), 0);
  EXPECT_EQ(f.set_force(0, 0, 0, 0), -1) << "the regulation has the motors";
  ASSERT_EQ(f.drd_stop(true, 0), 0);
  EXPECT_EQ(f.set_force(0, 0, 0, 0), 0);
  stand_in.control().advance(0.05);
  const double steps = height_m() / 1e-5;
  EXPECT_LT(steps, -1.0) << "it sags";
  EXPECT_NEAR(steps, std::round(steps), 1e-6);
}

TEST_F(ForceDimensionStandIn, LibdrdKnowsOnlyWhatItOpenedAndClosesThatItself) {
  ASSERT_EQ(f.open_id(0), 0);
  EXPECT_FALSE(f.drd_is_initialized(0));
  EXPECT_EQ(f.drd_auto_init(0), -1);
  EXPECT_EQ(f.drd_stop(true, 0), -1);
  EXPECT_EQ(f.drd_close(0), -1);
  ASSERT_EQ(f.drd_open_id(0), 0);
  EXPECT_TRUE(f.drd_is_initialized(0));
  EXPECT_EQ(f.close(0), -1);
  EXPECT_EQ(f.drd_close(0), 0);
  EXPECT_FALSE(stand_in.state().open);

  stand_in.script().drd_needs_its_own_open = false;
  ASSERT_EQ(f.open_id(0), 0);
  EXPECT_TRUE(f.drd_is_initialized(0));
  EXPECT_EQ(f.close(0), 0);
}

TEST_F(ForceDimensionStandIn, PowerThatGoesTakesCalibrationWatchdogAndForce) {
  ASSERT_EQ(f.open_id(0), 0);
  f.enable_expert_mode();
  f.set_watchdog(160, 0);
  f.enable_force(1, 0);
  f.set_force(5.0, 0, 0, 0);
  stand_in.control().advance(0.001);
  stand_in.script().powered = false;
  stand_in.control().advance(0.001);
  EXPECT_EQ(stand_in.state().motor_N[0], 0.0);
  stand_in.script().powered = true;
  EXPECT_EQ(stand_in.state().mode, sim::devices::ForceDimensionMode::kReset);
  EXPECT_EQ(stand_in.state().watchdog_ticks, 0);
  EXPECT_EQ(f.enable_force(1, 0), -1);
}

TEST_F(ForceDimensionStandIn, BrakesAndClosingKeepTheCommandUnlessToldOtherwise) {
  for (const bool kind : {false, true}) {
    stand_in.control().reset(1);
    stand_in.script().brake_keeps_command = !kind;
    stand_in.script().close_keeps_mode = !kind;
    ASSERT_EQ(f.open_id(0), 0);
    f.enable_force(1, 0);
    f.set_force(5.0, 0, 0, 0);
    f.stop(0);
    f.enable_force(1, 0);
    EXPECT_EQ(stand_in.state().brought_back_N[0], kind ? 0.0 : 5.0);
    stand_in.control().advance(0.02);
    EXPECT_NEAR(stand_in.state().motor_N[0], kind ? 0.0 : 5.0, 1e-3);
    f.stop(0);
    f.set_force(3.0, 0, 0, 0);
    f.enable_force(1, 0);
    EXPECT_EQ(stand_in.state().brought_back_N[0], kind ? 0.0 : 3.0) << "taken with the brakes on";
    f.close(0);
    EXPECT_EQ(stand_in.state().mode == sim::devices::ForceDimensionMode::kBrake, kind);
  }
}

TEST_F(ForceDimensionStandIn, RateIsThatOfForceCommandsInKilohertz) {
  const auto rate_kHz = stand_in.symbol<double(char)>("dhdGetComFreq");
  ASSERT_NE(rate_kHz, nullptr);
  ASSERT_EQ(f.open_id(0), 0);
  rate_kHz(0);
  for (int i = 0; i < 100; ++i) {
    f.set_force(0, 0, 0, 0);
    (void)height_m();
    stand_in.control().advance(0.0005);
  }
  EXPECT_NEAR(rate_kHz(0), 2.0, 1e-6);
  stand_in.control().advance(0.1);
  EXPECT_EQ(rate_kHz(0), 0.0);
}

TEST_F(ForceDimensionStandIn, ChosenCallFailsBeforeOrAfterItWorked) {
  for (const bool works : {false, true}) {
    stand_in.control().reset(1);
    stand_in.calls() = {.failing = 2, .failing_code = 8, .failing_works = works};
    ASSERT_EQ(f.open_id(0), 0);
    EXPECT_EQ(f.set_max_force(5.0, 0), -1);
    EXPECT_EQ(f.error_get_last(), 8);
    EXPECT_EQ(stand_in.state().max_force_N, works ? 5.0 : -1.0);
    EXPECT_EQ(f.set_max_force(6.0, 0), 0);
    EXPECT_EQ(stand_in.calls().made, 3);
  }
}

TEST_F(ForceDimensionStandIn, SlowCallsTakeTheirTime) {
  ASSERT_EQ(f.open_id(0), 0);
  stand_in.calls().cost_s = 0.002;
  (void)height_m();
  (void)height_m();
  EXPECT_NEAR(stand_in.state().time_s, 0.004, 1e-9);
}

TEST_F(ForceDimensionStandIn, HeldCallReturnsWhenLetGo) {
  ASSERT_EQ(f.open_id(0), 0);
  stand_in.control().hold(true);
  int type = 0;
  std::thread caller([&] { type = f.get_system_type(0); });
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (stand_in.control().held() == 0 && std::chrono::steady_clock::now() < deadline)
    std::this_thread::yield();
  EXPECT_EQ(stand_in.control().held(), 1);
  EXPECT_EQ(stand_in.calls().made, 1);
  stand_in.control().hold(false);
  caller.join();
  EXPECT_EQ(type, kOmega6Right);
}

TEST_F(ForceDimensionStandIn, GravityIsCompensatedByForceCommandsOnly) {
  ASSERT_EQ(f.open_id(0), 0);
  f.set_gravity_compensation(1, 0);
  f.enable_force(1, 0);
  stand_in.control().advance(0.02);
  const double sunk_m = height_m();
  EXPECT_LT(sunk_m, -1e-3) << "nothing is sent";
  f.set_force(0, 0, 0, 0);
  stand_in.control().advance(1.0);
  const double held_m = height_m();
  stand_in.control().advance(1.0);
  EXPECT_EQ(height_m(), held_m);
}

}  // namespace force_dimension_stand_in_test
}  // namespace drivers::haptic
