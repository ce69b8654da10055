// Forces that push the arm back: directions by hand calculation, and all together against the gradient of a
// potential that is implemented independently here.
#include "control/arm_protection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include "tests/support/no_alloc_guard.h"

namespace arm_protection_test {

using control::ArmProtection;
using control::ArmVector;
using control::ChainVector;
using control::JointRange;
using control::kArmJoints;
using control::kBaseAxes;
using control::Link;
using control::RobotModel;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;
const ArmProtection::Config kConfig{.joint_margin_rad = 0.12,
                                    .joint_torque_Nm = {6, 8, 5, 2, 1},
                                    .joint_damping_ratio = 1,
                                    .straight_joint3_rad = -146 * kDegree,
                                    .elbow_bend_rad = 0.15,
                                    .elbow_torque_Nm = 1.5,
                                    .shoulder_radius_m = 0.08,
                                    .clearance_m = 0.03,
                                    .push_N = 30,
                                    .push_damping_N_s_per_m = 60,
                                    .body_half_size_m = {0.29, 0.19, 0.14},
                                    .foot_radius_m = 0.09,
                                    .foot_height_m = 0.24,
                                    .tip_radius_m = 0.03,
                                    .wrist_radius_m = 0.06};

/// Joints 2 to 4 in degrees from where the arm points straight up.
ArmVector posture(double joint_2_deg, double joint_3_deg, double joint_4_deg) {
  return kDegree *
         (ArmVector() << 169, 65 + joint_2_deg, -146 + joint_3_deg, 102.5 + joint_4_deg, 167.5).finished();
}
/// Elbow up, hand ahead: far from everything.
const ArmVector kFree = posture(-10, 80, 40);

ChainVector chain(const Vector3d& base, const ArmVector& arm_rad) {
  return (ChainVector() << base, arm_rad).finished();
}

struct Guarded {
  Guarded() : protection(kConfig, model.ranges()) {}
  ArmProtection::Output at(const ArmVector& q, const ArmVector& v = ArmVector::Zero(),
                           const Vector3d& base = Vector3d::Zero()) {
    model.update(chain(base, q));
    return protection.torque(model, q, v);
  }
  RobotModel model;
  ArmProtection protection;
};

double spring_J(double depth, double at_full, double full_depth) {
  return depth > 0 ? at_full / full_depth * depth * depth / 2 : 0;
}

/// Distance to the body: a box that stands on the floor, open below.
double outside_box_m(const Vector3d& p_B) {
  const Vector3d& half = kConfig.body_half_size_m;
  const Vector3d nearest(std::clamp(p_B.x(), -half.x(), half.x()), std::clamp(p_B.y(), -half.y(), half.y()),
                         std::min(p_B.z(), half.z()));
  if (nearest != p_B) return (p_B - nearest).norm();
  return -std::min({half.x() - std::abs(p_B.x()), half.y() - std::abs(p_B.y()), half.z() - p_B.z()});
}

/// Distance to the arm's foot: a column that stands on the floor.
double foot_m(const Vector3d& p_B) {
  const double aside_m = std::hypot(p_B.x() - control::kJoint1_x_m, p_B.y()) - kConfig.foot_radius_m;
  const double above_m = p_B.z() - kConfig.foot_height_m;
  return aside_m > 0 && above_m > 0 ? std::hypot(aside_m, above_m) : std::max(aside_m, above_m);
}

/// What all the springs hold.
double potential_J(RobotModel& model, const ChainVector& q) {
  model.update(q);
  double sum_J = 0;
  for (int i = 0; i < kArmJoints; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    const double at_limit_Nm = kConfig.joint_torque_Nm[joint];
    const double lower_rad = model.ranges()[joint].lower_rad, upper_rad = model.ranges()[joint].upper_rad;
    sum_J += spring_J(lower_rad + 0.12 - q[kBaseAxes + i], at_limit_Nm, 0.12) +
             spring_J(q[kBaseAxes + i] - upper_rad + 0.12, at_limit_Nm, 0.12);
  }
  sum_J += spring_J(-146 * kDegree + 0.15 - q[kBaseAxes + 2], 1.5, 0.15);

  const Eigen::Isometry3d X_BW = model.X_WL(Link::kBase).inverse();
  const Vector3d tip_B = X_BW * model.X_WT().translation();
  const Vector3d wrist_B = X_BW * model.X_WL(Link::kArm5).translation();
  for (const auto& [p_B, radius_m] : {std::pair{tip_B, 0.03}, std::pair{wrist_B, 0.06}}) {
    const double height_m = p_B.z() + X_BW.inverse().translation().z();
    sum_J += spring_J(0.03 - (height_m - radius_m), 30, 0.03);
    sum_J += spring_J(0.03 - (outside_box_m(p_B) - radius_m), 30, 0.03);
    sum_J += spring_J(0.03 - (foot_m(p_B) - radius_m), 30, 0.03);
  }
  return sum_J + spring_J(0.03 - (std::hypot(tip_B.x() - control::kJoint1_x_m, tip_B.y()) - 0.08), 30, 0.03);
}

TEST(ArmProtection, LeavesAFreeArmAlone) {
  Guarded arm;
  const auto output = arm.at(kFree, ArmVector::Constant(1.0));
  EXPECT_EQ(output.torque_Nm, ArmVector::Zero());
  EXPECT_FALSE(output.active);
}

TEST(ArmProtection, PushesEachJointOffBothItsEnds) {
  // Only the joints' limits: some of these postures lead into the floor.
  ArmProtection::Config config = kConfig;
  config.push_N = config.elbow_torque_Nm = 1e-12;
  RobotModel model;
  const ArmProtection protection(config, model.ranges());
  for (int i = 0; i < kArmJoints; ++i) {
    const JointRange& range = model.ranges()[static_cast<std::size_t>(i)];
    const double at_limit_Nm = config.joint_torque_Nm[static_cast<std::size_t>(i)];
    for (const double share : {0.0, 0.5, 1.0, 1.5})
      for (const bool lower : {true, false}) {
        ArmVector q = kFree;
        q[i] = lower ? range.lower_rad + 0.12 * (1 - share) : range.upper_rad - 0.12 * (1 - share);
        model.update(chain(Vector3d::Zero(), q));
        const auto output = protection.torque(model, q, ArmVector::Zero());
        const ArmVector expected_Nm = (lower ? 1 : -1) * share * at_limit_Nm * ArmVector::Unit(i);
        EXPECT_LT((output.torque_Nm - expected_Nm).norm(), 1e-9)
            << "joint " << i + 1 << (lower ? " lower " : " upper ") << share << ": "
            << output.torque_Nm.transpose();
      }
  }
}

TEST(ArmProtection, LetsNothingElseDriveAJointIntoItsStop) {
  Guarded arm;
  for (int i = 0; i < kArmJoints; ++i) {
    const JointRange& range = arm.model.ranges()[static_cast<std::size_t>(i)];
    for (const double share : {0.0, 0.25, 1.0, 1.5}) {
      const double allowed = std::min(1.0, share);
      ArmVector q = kFree;
      q[i] = range.lower_rad + 0.12 * share;
      const auto low = arm.at(q);
      EXPECT_TRUE(low.share_downwards.isApprox(ArmVector::Ones() - (1 - allowed) * ArmVector::Unit(i), 1e-9));
      EXPECT_EQ(low.share_upwards, ArmVector::Ones()) << "off it everything may";
      q[i] = range.upper_rad - 0.12 * share;
      const auto high = arm.at(q);
      EXPECT_TRUE(high.share_upwards.isApprox(ArmVector::Ones() - (1 - allowed) * ArmVector::Unit(i), 1e-9));
      EXPECT_EQ(high.share_downwards, ArmVector::Ones());
    }
  }
}

TEST(ArmProtection, BendsAnElbowThatIsNearlyStraight) {
  Guarded arm;
  for (const double bend_rad : {0.2, 0.1, 0.05, 0.04}) {
    const auto output = arm.at(posture(20, bend_rad / kDegree, 20));
    EXPECT_NEAR(output.torque_Nm[2], 10 * std::max(0.0, 0.15 - bend_rad), 1e-9) << bend_rad;
    EXPECT_EQ(output.active, bend_rad < 0.15);
  }
}

TEST(ArmProtection, KeepsTheTipOffTheAxisOfJoint1) {
  // Above it, and a little ahead or behind: pushed further that way.
  Guarded arm;
  for (const double sign : {-1.0, 1.0}) {
    ArmVector q = kFree;
    double best_m = 1;
    for (double joint_2_deg = -60; joint_2_deg < 20; joint_2_deg += 0.1) {
      const ArmVector candidate = posture(joint_2_deg, 30, -20);
      arm.model.update(chain(Vector3d::Zero(), candidate));
      const double off_m = arm.model.X_WT().translation().x() - control::kJoint1_x_m;
      if (std::abs(off_m - sign * 0.04) < best_m) q = candidate, best_m = std::abs(off_m - sign * 0.04);
    }
    ASSERT_LT(best_m, 2e-3);
    const auto output = arm.at(q);
    const Vector3d moved = arm.model.J_WT().topRightCorner<3, kArmJoints>() * output.torque_Nm;
    EXPECT_GT(sign * moved.x(), 0.1) << "the torque moves the tip outwards";
  }
}

TEST(ArmProtection, IsTheSlopeOfAPotentialWhereverTheArmIs) {
  Guarded arm;
  std::mt19937 random(31);
  const auto between = [&](double lower, double upper) {
    return std::uniform_real_distribution<double>(lower, upper)(random);
  };
  constexpr double kStep = 1e-6;
  int front = 0, back = 0, left = 0, right = 0, top = 0, floor = 0, foot = 0, active = 0;
  for (int n = 0; n < 40'000; ++n) {
    ChainVector q;
    q << between(-2, 2), between(-2, 2), between(-3, 3), ArmVector::Zero();
    for (int i = 0; i < kArmJoints; ++i) {
      const JointRange& range = arm.model.ranges()[static_cast<std::size_t>(i)];
      q[kBaseAxes + i] = between(range.lower_rad - 0.05, range.upper_rad + 0.05);
    }
    const ArmVector arm_rad = q.tail<kArmJoints>();
    const auto output = arm.at(arm_rad, ArmVector::Zero(), q.head<kBaseAxes>());

    const Eigen::Isometry3d X_BW = arm.model.X_WL(Link::kBase).inverse();
    const Vector3d tip_B = X_BW * arm.model.X_WT().translation();
    const Vector3d wrist_B = X_BW * arm.model.X_WL(Link::kArm5).translation();
    // Inside box and column the nearest face may change, and with it the direction.
    if (std::min(outside_box_m(tip_B), outside_box_m(wrist_B)) < -1e-6) continue;
    if (std::min(foot_m(tip_B), foot_m(wrist_B)) < -1e-6) continue;
    if (output.active) ++active;
    const double off_m = outside_box_m(tip_B);
    if (off_m > 0 && off_m < 0.05) {
      if (tip_B.x() > 0.29 && std::abs(tip_B.y()) < 0.19) ++front;
      if (tip_B.x() < -0.29 && std::abs(tip_B.y()) < 0.19) ++back;
      if (tip_B.y() > 0.19 && std::abs(tip_B.x()) < 0.29) ++left;
      if (tip_B.y() < -0.19 && std::abs(tip_B.x()) < 0.29) ++right;
      if (tip_B.z() > 0.14) ++top;
    }
    if (tip_B.z() < 0.05) ++floor;
    if (foot_m(wrist_B) < 0.08 && wrist_B.z() < 0.3) ++foot;

    const double scale_Nm = std::max(1.0, output.torque_Nm.norm());
    for (int i = 0; i < kArmJoints; ++i) {
      const ChainVector along = kStep * ChainVector::Unit(kBaseAxes + i);
      const double slope =
          (potential_J(arm.model, q + along) - potential_J(arm.model, q - along)) / (2 * kStep);
      // A kink within the difference is off by the stiffness times the step.
      ASSERT_NEAR(output.torque_Nm[i], -slope, 1e-3 * scale_Nm)
          << "joint " << i + 1 << " at " << q.transpose();
    }
  }
  for (const int seen : {front, back, left, right, top, floor, foot}) EXPECT_GT(seen, 5);
  EXPECT_GT(active, 1000);
}

TEST(ArmProtection, ItsDamperTakesFromWhatGoesFurtherInAndLeavesWhatComesOut) {
  Guarded arm;
  std::mt19937 random(37);
  std::uniform_real_distribution<double> any(-1, 1);
  int taken = 0;
  for (int n = 0; n < 5000; ++n) {
    ArmVector q, v;
    for (int i = 0; i < kArmJoints; ++i) {
      const JointRange& range = arm.model.ranges()[static_cast<std::size_t>(i)];
      q[i] = (range.lower_rad + range.upper_rad) / 2 + any(random) * (range.upper_rad - range.lower_rad) / 2;
      v[i] = 2 * any(random);
    }
    const double power_W = (arm.at(q, v).torque_Nm - arm.at(q).torque_Nm).dot(v);
    ASSERT_LE(power_W, 1e-9);
    if (power_W < -1e-6) ++taken;
  }
  EXPECT_GT(taken, 1000);

  ArmVector q = kFree;
  q[3] = arm.model.ranges()[3].upper_rad;
  EXPECT_EQ(arm.at(q, -ArmVector::Unit(3)).torque_Nm, arm.at(q).torque_Nm) << "out of the limit";
  EXPECT_LT(arm.at(q, ArmVector::Unit(3)).torque_Nm[3], arm.at(q).torque_Nm[3] - 0.1) << "further in";
}

TEST(ArmProtection, WhatLeavesTheFloorIsNotHeldBack) {
  Guarded arm;
  const ArmVector q = posture(80, 30, 60);
  const ArmVector still_Nm = arm.at(q).torque_Nm;
  const ArmVector up = arm.model.J_WT().row(2).tail<kArmJoints>();
  const ArmVector wrist_up = arm.model.point_jacobian(Link::kArm5, arm.model.X_WL(Link::kArm5).translation())
                                 .row(2)
                                 .tail<kArmJoints>();
  ASSERT_GT(still_Nm.dot(up), 0.1) << "the floor pushes here";
  const ArmVector v = up.normalized() + wrist_up.normalized();
  EXPECT_EQ(arm.at(q, v).torque_Nm, still_Nm);
  EXPECT_LT((arm.at(q, -v).torque_Nm - still_Nm).dot(-v), -0.01) << "going in is damped";
}

TEST(ArmProtection, OnAClosedWayThroughItsZonesNoEnergyComesOut) {
  Guarded arm;
  // Down into the floor ahead of the robot, and along the end stop of joint 4.
  for (const ArmVector& centre : {posture(80, 30, 60), posture(60, 60, 100), posture(75, 60, 45)})
    for (const bool damped : {false, true}) {
      constexpr int kSteps = 4000;
      const auto at = [&](double t) {
        return ArmVector(centre + 0.25 * (ArmVector() << std::cos(t), std::sin(t), std::cos(2 * t),
                                          std::sin(t + 1), std::sin(3 * t))
                                             .finished());
      };
      double energy_J = 0, most_W = 0;
      for (int n = 0; n < kSteps; ++n) {
        const double t = 2 * std::numbers::pi * n / kSteps, step = 2 * std::numbers::pi / kSteps;
        const ArmVector way = at(t + step / 2) - at(t - step / 2);
        // One turn in 2π seconds.
        const auto output = arm.at(at(t), damped ? ArmVector(way / step) : ArmVector::Zero());
        energy_J += output.torque_Nm.dot(way);
        most_W = std::max(most_W, std::abs(output.torque_Nm.dot(way)) / step);
      }
      EXPECT_GT(most_W, 0.1) << "it led through a zone";
      if (damped)
        EXPECT_LT(energy_J, -1e-3);
      else
        EXPECT_NEAR(energy_J, 0, 1e-3 * most_W);
    }
}

TEST(ArmProtection, RefusesWhatIsNotPositiveByName) {
  using Config = ArmProtection::Config;
  const RobotModel model;
  const auto refusal = [&](const Config& config) -> std::string {
    try {
      const ArmProtection protection(config, model.ranges());
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(refusal(kConfig), "none");
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    for (const auto& [name, member] :
         {std::pair{"joint_margin_rad", &Config::joint_margin_rad},
          std::pair{"elbow_bend_rad", &Config::elbow_bend_rad},
          std::pair{"shoulder_radius_m", &Config::shoulder_radius_m},
          std::pair{"clearance_m", &Config::clearance_m}, std::pair{"push_N", &Config::push_N}}) {
      Config config = kConfig;
      config.*member = bad;
      EXPECT_NE(refusal(config).find(name), std::string::npos) << refusal(config);
    }
    Config config = kConfig;
    config.joint_torque_Nm[3] = bad;
    EXPECT_NE(refusal(config).find("joint_torque_Nm"), std::string::npos) << refusal(config);
  }
  Config wide = kConfig;
  wide.joint_margin_rad = 1.5;  // joint 2 has 2.7 rad
  EXPECT_NE(refusal(wide).find("joint_margin_rad"), std::string::npos) << refusal(wide);
}

TEST(ArmProtection, DoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  Guarded arm;
  const support::NoAllocGuard guard;
  const auto output = arm.at(posture(90, 0, 90), ArmVector::Ones());
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_TRUE(output.active);
}

}  // namespace arm_protection_test
