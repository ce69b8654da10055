// The arm's limits against the robot description and the simulated robot.
#include "hal/youbot_axes.h"

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "control/robot_model.h"
#include "sim/bus/axis_data.h"

namespace hal {
namespace youbot_axes_test {

TEST(YoubotAxes, RangesLieWithinTheEndStopsOfTheDescription) {
  const auto stops = control::RobotModel().ranges();
  // Official driver's configuration: soft limits in ticks of the motor, which turns the other way but at
  // joint 3.
  constexpr std::array<std::array<double, 2>, 5> kTicks{
      {{1000, 580000}, {1000, 260000}, {-320000, -1000}, {1000, 155000}, {5000, 255000}}};
  for (std::size_t i = 0; i < kArmAxes.size(); ++i) {
    const JointRange& range = kArmAxes[i].range;
    const double rad_per_tick = AxisScale(kArmAxes[i].constants).position_resolution_rad();
    EXPECT_NEAR(range.lower_rad, kTicks[i][0] * rad_per_tick, 1e-5);
    EXPECT_NEAR(range.upper_rad, kTicks[i][1] * rad_per_tick, 1e-5);
    EXPECT_GT(range.lower_rad, stops[i].lower_rad);
    EXPECT_LT(range.upper_rad, stops[i].upper_rad);
    EXPECT_GT(range.lower_rad, sim::bus::kArmJointData[i].lower_stop_rad);
    EXPECT_LT(range.upper_rad, sim::bus::kArmJointData[i].upper_stop_rad);
    EXPECT_TRUE(range.limited());
  }
  EXPECT_FALSE(kWheelAxis.range.limited());
}

TEST(YoubotAxes, RatedTorquesAreTheEffortsOfTheDescriptionAndBelowWhatMotorsCan) {
  const std::string urdf(control::youbot_urdf());
  for (std::size_t i = 0; i < kArmAxes.size(); ++i) {
    const std::size_t joint = urdf.find("<joint name=\"arm_joint_" + std::to_string(i + 1) + "\"");
    ASSERT_NE(joint, std::string::npos);
    const std::string key = "effort=\"";
    const double effort_Nm = std::stod(urdf.substr(urdf.find(key, joint) + key.size()));
    const JointInfo info = joint_info("arm", kArmAxes[i]);
    EXPECT_EQ(info.rated_torque_Nm, effort_Nm);
    EXPECT_GT(info.torque_limit_Nm, effort_Nm);
  }
}

}  // namespace youbot_axes_test
}  // namespace hal
