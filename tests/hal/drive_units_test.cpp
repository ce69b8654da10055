#include "hal/drive_units.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "drivers/tmcl/process_data.h"

namespace hal {
namespace drive_units_test {

namespace tmcl = drivers::tmcl;
using tmcl::StatusFlag;

tmcl::StatusFlags with(StatusFlag flag) { return tmcl::StatusFlags(1U << static_cast<unsigned>(flag)); }

TEST(DriveUnits, EveryErrorFlagIsAJointFaultOfItsOwnAndNothingElseIs) {
  const auto expected = [](StatusFlag flag) {
    switch (flag) {
      case StatusFlag::kUndervoltage: return JointFault::kUndervoltage;
      case StatusFlag::kOvervoltage: return JointFault::kOvervoltage;
      case StatusFlag::kOvertemperature: return JointFault::kOvertemperature;
      case StatusFlag::kHallSensorError: return JointFault::kHallSensor;
      case StatusFlag::kEncoderError: return JointFault::kEncoder;
      case StatusFlag::kInitializationError: return JointFault::kNotInitialized;
      case StatusFlag::kEmergencyStop: return JointFault::kEmergencyStop;
      case StatusFlag::kTimeout: return JointFault::kCommandTimeout;
      case StatusFlag::kI2tExceeded: return JointFault::kI2t;
      default: return JointFault::kNone;
    }
  };
  for (const tmcl::FlagInfo& row : tmcl::kStatusFlags) {
    EXPECT_EQ(joint_fault_of(with(row.flag)), expected(row.flag)) << row.name;
    EXPECT_EQ(joint_fault_of(with(row.flag)) != JointFault::kNone, row.kind == tmcl::FlagKind::kError)
        << row.name;
  }
  EXPECT_EQ(joint_fault_of({}), JointFault::kNone);
  EXPECT_EQ(joint_fault_of(tmcl::StatusFlags(0xFFFF'FFFF)), JointFault::kCommandTimeout) << "the gravest";
}

TEST(DriveUnits, NoVelocityCommandIsFasterThanItsAxis) {
  const auto expect_limited = [](const AxisData& axis, double limit_rad_per_s) {
    const DriveUnits units(axis, false);
    const auto rpm = [&](double velocity_rad_per_s) {
      const tmcl::DriveOutput output =
          units.output(JointCommand::velocity_rad_per_s(velocity_rad_per_s), {}, 0);
      EXPECT_EQ(output.mode, tmcl::ControllerMode::kVelocity);
      return output.value;
    };
    const double sign = axis.constants.inverted ? -1 : 1;
    const double limit_rpm = sign * limit_rad_per_s * axis.constants.gear_ratio * 60 / (2 * std::numbers::pi);
    for (const double fast : {limit_rad_per_s, limit_rad_per_s * 1.01, 1e3, 1e9, 1e300}) {
      EXPECT_NEAR(rpm(fast), limit_rpm, 0.5) << fast;
      EXPECT_NEAR(rpm(-fast), -limit_rpm, 0.5) << fast;
    }
    EXPECT_NEAR(rpm(limit_rad_per_s / 2), limit_rpm / 2, 0.5) << "slower ones are left alone";
  };
  expect_limited(kWheelAxis, 16.2);                                  // 4000 rpm of the motor
  for (const AxisData& axis : kArmAxes) expect_limited(axis, 1.57);  // 90 degrees a second
}

}  // namespace drive_units_test
}  // namespace hal
