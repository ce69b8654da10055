// Forces on bases of each kinematics, against numbers worked out by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "identification/robot_gap/base_effort.h"
#include "identification/robot_gap/base_experiments.h"

namespace base_kinematics_effort_test {

using control::BaseDescription;
using control::BaseKinematics;
using identification::robot_gap::BaseForces;
using identification::robot_gap::EffortWindow;

const double kRoot3 = std::sqrt(3.0);

EffortWindow moving(const Eigen::VectorXd& speed, const Eigen::VectorXd& acceleration,
                    const Eigen::VectorXd& torque) {
  EffortWindow window;
  window.speed_rad_per_s = speed;
  window.speed_products = speed * speed.transpose();
  window.sign = speed.cwiseSign();
  window.acceleration_rad_per_s2 = window.rolled_rad_per_s2 = acceleration;
  window.torque_Nm = torque;
  return window;
}

Eigen::Vector3d excess(const BaseDescription& base, const EffortWindow& window) {
  return BaseForces(base, base, -1).excess(window);
}

BaseDescription mecanum() {
  BaseDescription base{
      .kinematics = BaseKinematics::kMecanum,
      .wheels = {{"front_left", 0.05}, {"front_right", 0.05}, {"rear_left", 0.05}, {"rear_right", 0.05}},
      .turning_length_m = 0.4};
  base.body.mass_kg = 20;
  base.body.yaw_inertia_kg_m2 = 1;
  return base;
}

// To the left, front wheels turn forward by their sign and rear ones backward; 0.5 m/s² of 20 kg are 10 N, a
// quarter from each wheel at 0.05 m.
TEST(MecanumForces, SpeedingUpSidewaysIsTheWorkOfAllFourWheels) {
  BaseDescription base = mecanum();
  const Eigen::Vector4d way(1, 1, -1, -1);
  EffortWindow window = moving(4 * way, 10 * way, 0.125 * way);
  EXPECT_NEAR(excess(base, window).norm(), 0, 1e-12);
  base.body.sideways_resistance_N = 3;
  window.sideways_sign = 1;
  EXPECT_NEAR(excess(base, window)[1], -3, 1e-12);
}

// 2 rad/s² of 1 kg·m² are 2 N·m: 0.0625 N·m of each wheel, at the lever of 0.4 m. The wheels speed up by
// 0.4·2/0.05 rad/s².
TEST(MecanumForces, TurningNeedsTheInertiaAtTheLever) {
  const Eigen::Vector4d all = Eigen::Vector4d::Ones();
  EXPECT_NEAR(excess(mecanum(), moving(4 * all, 16 * all, 0.0625 * all)).norm(), 0, 1e-12);
}

// Wheels of one diagonal against those of the other push nothing.
TEST(MecanumForces, StrainBetweenTheWheelsMovesNothing) {
  const Eigen::Vector4d rest = Eigen::Vector4d::Zero();
  EXPECT_NEAR(
      BaseForces(mecanum(), mecanum(), -1).pushed(moving(rest, rest, Eigen::Vector4d(1, -1, -1, 1))).norm(),
      0, 1e-12);
}

BaseDescription omni() {
  BaseDescription base{.kinematics = BaseKinematics::kOmni,
                       .wheels = {{"wheel1", 0.05, std::numbers::pi / 3},
                                  {"wheel2", 0.05, std::numbers::pi},
                                  {"wheel3", 0.05, -std::numbers::pi / 3}},
                       .turning_length_m = 0.2};
  base.body.mass_kg = 9;
  base.body.yaw_inertia_kg_m2 = 0.15;
  return base;
}

// Forward the wheels at ±60° roll by √3/2 of the way, the one behind not at all. 4.5 N: 4.5·0.05/√3 N·m of
// each.
TEST(OmniForces, SpeedingUpForwardIsTheWorkOfTwoWheels) {
  const Eigen::Vector3d way(-1, 0, 1);
  const double rolled = kRoot3 / 2 * 0.5 / 0.05;
  const EffortWindow window = moving(4 * way, rolled * way, 4.5 * 0.05 / kRoot3 * way);
  EXPECT_NEAR(excess(omni(), window).norm(), 0, 1e-12);
}

// 0.3 N·m for 2 rad/s², over three wheels at 0.2 m.
TEST(OmniForces, TurningIsTheWorkOfAllThree) {
  const Eigen::Vector3d all = Eigen::Vector3d::Ones();
  EXPECT_NEAR(excess(omni(), moving(4 * all, 8 * all, 0.025 * all)).norm(), 0, 1e-12);
}

// 1 m/s forward and 0.5 rad/s: 9 kg need 4.5 N to the left.
TEST(OmniForces, ACurveNeedsAForceSideways) {
  const double turn = 0.2 * 0.5 / 0.05;
  const double way = kRoot3 / 2 / 0.05;
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  const Eigen::Vector3d force =
      excess(omni(), moving(Eigen::Vector3d(turn - way, turn, turn + way), none, none));
  EXPECT_TRUE(force.isApprox(Eigen::Vector3d(0, -4.5, 0), 1e-9)) << force.transpose();
}

BaseDescription tricycle() {
  BaseDescription base{
      .kinematics = BaseKinematics::kTricycle, .wheels = {{"front", 0.05}}, .turning_length_m = 0.5};
  base.body.mass_kg = 10;
  base.body.yaw_inertia_kg_m2 = 0.4;
  return base;
}

/// The rim of the steered wheel at a speed and its change, steered by an angle.
EffortWindow steered(double degrees, double speed_m_per_s, double change_m_per_s2) {
  const double c = degrees == 90 ? 0 : std::cos(degrees * std::numbers::pi / 180);
  const double s = std::sin(degrees * std::numbers::pi / 180);
  const double rate = change_m_per_s2 / 0.05;
  EffortWindow window = moving(Eigen::VectorXd::Constant(1, speed_m_per_s / 0.05),
                               Eigen::VectorXd::Constant(1, rate), Eigen::VectorXd::Zero(1));
  window.steered = {.cc = c * c * rate,
                    .ss = s * s * rate,
                    .cs = c * s * rate,
                    .sc = c * s * rate,
                    .css = c * s * s * speed_m_per_s * speed_m_per_s / (0.05 * 0.05),
                    .c_yaw = {c, 0},
                    .s_yaw = {s, 0},
                    .s_turning_sign = s};
  return window;
}

// At 45° 1 m/s² of the rim are 0.707 m/s² forward, 7.07 N, and 1.414 rad/s², 0.566 N·m: along the wheel
// 7.07·0.707 + 0.566·0.707/0.5.
TEST(TricycleForces, At45DegreesMassAndInertiaShareTheForce) {
  BaseDescription base = tricycle();
  EXPECT_NEAR(excess(base, steered(45, 0, 1))[0], -(5 + 0.8), 1e-9);
  // 0.1 m ahead, the inertia about the axle's middle is 0.5.
  base.body.p_BC_m = {0.1, 0};
  EXPECT_NEAR(excess(base, steered(45, 1, 1))[0], -(5 + 1), 1e-9);
  // 0.1 m to the left, it holds back as the base turns to the left: twice 10·0.1·0.707·1.414.
  base.body.p_BC_m = {0, 0.1};
  EXPECT_NEAR(excess(base, steered(45, 0, 1))[0], -(5 + 1 - 2), 1e-9);
}

// With 10 % slip forward: 0.636 m/s² and 0.636 m/s forward, but 1.414 rad/s² and 1.414 rad/s as before.
TEST(TricycleForces, SlipTakesItsShareOfTheMotion) {
  BaseDescription base = tricycle();
  base.slip_forward = 0.1;
  EXPECT_NEAR(excess(base, steered(45, 0, 1))[0], -(4.5 + 0.8), 1e-9);
  // The centre of mass 0.1 m ahead needs 2 N inwards along x and 0.9 N·m.
  base.body.p_BC_m = {0.1, 0};
  const double turning_N = (0.9 / 0.5 - 2) * std::sqrt(0.5);
  EXPECT_NEAR(excess(base, steered(45, 1, 0))[0], -turning_N, 1e-9);
  base.slip_forward = 0;
  base.floors = {{.name = "ice", .slip = 0.5}};
  base.body.p_BC_m.setZero();
  EXPECT_NEAR(BaseForces(base, base, 0).excess(steered(45, 0, 1))[0], -0.5 * (5 + 0.8), 1e-9);
}

// Steered across, the wheel turns the base about the middle of its axle: 2 rad/s² of 0.4 kg·m² at 0.5 m.
TEST(TricycleForces, At90DegreesOnlyInertiaAndResistanceCount) {
  BaseDescription base = tricycle();
  EXPECT_NEAR(excess(base, steered(90, 0, 1))[0], -1.6, 1e-9);
  base.body.turning_resistance_Nm = 0.5;
  EXPECT_NEAR(excess(base, steered(90, 1, 1))[0], -(1.6 + 1), 1e-9);
  // A centre of mass 0.1 m ahead weighs 98.1 N·0.02 across the slope, at 0.1 m.
  base = tricycle();
  base.body.p_BC_m = {0.1, 0};
  base.body.slope = {0, 0.02};
  EXPECT_NEAR(excess(base, steered(90, 1, 0))[0], -98.1 * 0.02 * 0.1 / 0.5, 1e-9);
}

TEST(TricycleForces, ACircleDecidesAboutTheInertia) {
  const BaseDescription given = tricycle();
  BaseDescription other = given;
  other.body.yaw_inertia_kg_m2 += 0.5;
  const identification::robot_gap::SeenMotion seen{.given = given,
                                                   .speed_m_per_s = 0.5,
                                                   .turn_rad_per_s = 1,
                                                   .window_s = 1,
                                                   .load = {},
                                                   .noise_floor = {}};
  const std::string text = identification::robot_gap::deciding_force(other, given, seen, {0.1, 0.1, 0.1});
  EXPECT_TRUE(text.starts_with("speeding up on a circle")) << text;
}

}  // namespace base_kinematics_effort_test
