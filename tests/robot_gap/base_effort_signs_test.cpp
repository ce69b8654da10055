// Torques whose sign is wrong or lost are refused; those that a slope makes look odd are not.
#include "identification/robot_gap/base_effort_signs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace base_effort_signs_test {

using control::BaseDescription;
using control::BaseKinematics;
using identification::robot_gap::check_torque_signs;
using identification::robot_gap::EffortWindow;

constexpr double kGravity_m_per_s2 = 9.81;

BaseDescription ten_kilograms() {
  BaseDescription base{.kinematics = BaseKinematics::kDifferential,
                       .wheels = {{"left", 0.05}, {"right", 0.05}},
                       .turning_length_m = 0.4};
  base.body.mass_kg = 10;
  base.body.yaw_inertia_kg_m2 = 0.3;
  for (BaseDescription::Wheel& wheel : base.wheels) wheel.coulomb_Nm = 0.05;
  return base;
}

/// To and fro along x, which rises by `slope`: each wheel has half of the force, at 0.05 m.
std::vector<std::vector<EffortWindow>> driven(double slope, bool only_forwards = false) {
  std::vector<EffortWindow> windows;
  for (int i = 0; i < 200; ++i) {
    const double speed = 4 + 2 * std::sin(0.9 * i);
    const double way = only_forwards || i % 2 == 0 ? 1 : -1;
    const double acceleration = 5 * std::sin(0.37 * i);
    const double noise_Nm = 0.002 * std::sin(2.71 * i * i);
    const double force_N = 10 * (0.05 * acceleration + kGravity_m_per_s2 * slope);
    EffortWindow window;
    window.sign = Eigen::Vector2d::Constant(way);
    window.speed_rad_per_s = way * Eigen::Vector2d::Constant(speed);
    window.speed_products = speed * speed * Eigen::Matrix2d::Ones();
    window.acceleration_rad_per_s2 = window.rolled_rad_per_s2 = Eigen::Vector2d::Constant(acceleration);
    window.torque_Nm = Eigen::Vector2d::Constant(force_N * 0.05 / 2 + way * (0.05 + 0.01 * speed) + noise_Nm);
    windows.push_back(window);
  }
  return {windows};
}

std::string refusal(const std::vector<std::vector<EffortWindow>>& windows) {
  try {
    check_torque_signs(ten_kilograms(), windows);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(TorqueSigns, OfALevelFloorAreNothingToReport) {
  EXPECT_TRUE(check_torque_signs(ten_kilograms(), driven(0)).empty());
}

TEST(TorqueSigns, OnASteepSlopeThatIsGivenTorquesArePositiveBothWays) {
  BaseDescription given = ten_kilograms();
  given.body.slope = {0.15, 0};  // 0.37 N·m of each wheel
  EXPECT_TRUE(check_torque_signs(given, driven(0.15)).empty());
}

// Reported torques are half as large where the true ones are twice those reported.
TEST(TorqueSigns, AGivenSlopeCountsByTheGivenTorqueScale) {
  for (const double scale : {2.0, 0.5}) {
    BaseDescription given = ten_kilograms();
    given.body.slope = {0.15, 0};
    for (BaseDescription::Wheel& wheel : given.wheels) wheel.torque_scale = scale;
    auto windows = driven(0.15);
    for (EffortWindow& window : windows[0]) window.torque_Nm /= scale;
    EXPECT_TRUE(check_torque_signs(given, windows).empty()) << scale;
  }
}

TEST(TorqueSigns, AnOffsetThatIsGivenIsNothingToReport) {
  BaseDescription given = ten_kilograms();
  auto windows = driven(0);
  for (BaseDescription::Wheel& wheel : given.wheels) {
    wheel.torque_scale = 2;
    wheel.offset_Nm = 0.6;
  }
  for (EffortWindow& window : windows[0]) window.torque_Nm = (window.torque_Nm.array() + 0.6) / 2;
  EXPECT_TRUE(check_torque_signs(given, windows).empty());
  for (BaseDescription::Wheel& wheel : given.wheels) wheel.offset_Nm = 0;
  EXPECT_EQ(check_torque_signs(given, windows).size(), 2U);
}

TEST(TorqueSigns, OnASlopeThatIsNotGivenTheyAreReportedOnly) {
  for (const double slope : {0.15, -0.15}) {
    const auto notes = check_torque_signs(ten_kilograms(), driven(slope));
    ASSERT_EQ(notes.size(), 2U);
    EXPECT_NE(notes[0].find(slope > 0 ? "left is positive" : "left is negative"), std::string::npos)
        << notes[0];
  }
}

TEST(TorqueSigns, DownhillABrakingTorqueIsReportedOnly) {
  const auto notes = check_torque_signs(ten_kilograms(), driven(-0.15, true));
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_NE(notes[1].find("right brakes the wheel most of the time"), std::string::npos) << notes[1];
  BaseDescription given = ten_kilograms();
  given.body.slope = {-0.15, 0};
  EXPECT_TRUE(check_torque_signs(given, driven(-0.15, true)).empty());
}

/// To and fro on one left arc: 10 N·m against turning are 10·0.05/0.4 = 1.25 N·m of each wheel, which push
/// the right one and brake the left one.
std::vector<std::vector<EffortWindow>> on_one_arc() {
  auto windows = driven(0);
  for (EffortWindow& window : windows[0]) {
    const double way = window.sign[0];
    window.turning_sign = way;
    window.torque_Nm += way * Eigen::Vector2d(-1.25, 1.25);
  }
  return windows;
}

TEST(TorqueSigns, OnOneArcTheInnerWheelBrakesIfTheBaseResistsTurning) {
  BaseDescription given = ten_kilograms();
  given.body.turning_resistance_Nm = 10;
  EXPECT_TRUE(check_torque_signs(given, on_one_arc()).empty());
  const auto notes = check_torque_signs(ten_kilograms(), on_one_arc());
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_NE(notes[0].find("left brakes the wheel"), std::string::npos) << notes[0];
}

TEST(TorqueSigns, ForwardsOnlyFrictionMayFallWithSpeed) {
  for (const double factor : {1.0, -1.0}) {
    auto windows = driven(0, true);
    for (std::size_t i = 0; i < windows[0].size(); ++i) {
      EffortWindow& window = windows[0][i];
      const double speed = 1.5 + 0.5 * std::sin(0.9 * static_cast<double>(i));
      const double by_mass_Nm = 10 * 0.05 * 0.05 / 2 * 0.1 * window.acceleration_rad_per_s2[0];
      window.speed_rad_per_s.setConstant(speed);
      window.speed_products.setConstant(speed * speed);
      window.acceleration_rad_per_s2 = window.rolled_rad_per_s2 = 0.1 * window.acceleration_rad_per_s2;
      window.torque_Nm.setConstant(factor * (by_mass_Nm + 0.1 - 0.03 * speed));
    }
    const auto notes = check_torque_signs(ten_kilograms(), windows);
    ASSERT_EQ(notes.size(), factor > 0 ? 0U : 2U);
    for (const std::string& note : notes) EXPECT_NE(note.find("brakes the wheel"), std::string::npos) << note;
  }
}

TEST(TorqueSigns, AMagnitudeIsRefusedWhateverItsFactor) {
  for (const double factor : {1.0, -1.0}) {
    auto windows = driven(0);
    for (EffortWindow& window : windows[0]) window.torque_Nm = factor * window.torque_Nm.cwiseAbs();
    const std::string text = refusal(windows);
    EXPECT_NE(text.find("it is a magnitude"), std::string::npos) << text;
    EXPECT_NE(text.find("load_column"), std::string::npos) << text;
  }
}

TEST(TorqueSigns, ANegatedTorqueIsRefusedWithTheRemedy) {
  for (const double slope : {0.0, 0.1}) {
    auto windows = driven(slope);
    for (EffortWindow& window : windows[0]) window.torque_Nm[1] *= -1;
    const std::string text = refusal(windows);
    EXPECT_NE(text.find("the torque of wheel right has the wrong sign"), std::string::npos) << text;
    EXPECT_NE(text.find("torque_factor"), std::string::npos) << text;
  }
}

TEST(TorqueSigns, ATorqueThatIsZeroIsRefused) {
  auto windows = driven(0);
  for (EffortWindow& window : windows[0]) window.torque_Nm[0] = 0;
  EXPECT_NE(refusal(windows).find("left is zero"), std::string::npos);
}

}  // namespace base_effort_signs_test
