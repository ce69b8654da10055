// Motions that are computed for an arm: they keep its limits, and what they are computed for they do well.
#include "identification/robot_gap/arm_excitation.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "identification/robot_gap/arm_motion.h"
#include "identification/robot_gap/rigid_arm.h"
#include "tests/robot_gap/hidden_arm.h"
#include "tests/robot_gap/robot_cases.h"

namespace robot_gap_test {
namespace {

using control::ArmDescription;
using identification::experiments::FourierMotion;
using identification::robot_gap::ExcitationLimits;
using identification::robot_gap::ExcitationOptions;
using identification::robot_gap::ExcitationPlan;
using identification::robot_gap::plan_for_information;
using identification::robot_gap::plan_for_separation;

constexpr Eigen::Index kElbowJoints = 4;

ArmDescription elbow_with_friction() { return published(elbow_arm(), HiddenArm(elbow_arm(), {}).friction()); }

/// The tip must stay above this height.
constexpr double kFloor_m = 0.3;

double tip_height_m(const ArmDescription& arm, const Eigen::VectorXd& q) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const control::ArmLink& link = arm.arm.links[static_cast<std::size_t>(j)];
    pose = pose * link.X_PL * Eigen::AngleAxisd(q[j], link.axis_L);
  }
  return (pose * arm.arm.X_LT).translation().z();
}

ExcitationLimits limits_of(const ArmDescription& arm) {
  ExcitationLimits limits;
  limits.motion = {Eigen::VectorXd::Constant(kElbowJoints, -1.5),
                   Eigen::VectorXd::Constant(kElbowJoints, 1.5), Eigen::VectorXd::Constant(kElbowJoints, 1.2),
                   Eigen::VectorXd::Constant(kElbowJoints, 2)};
  limits.torque_Nm = Eigen::Vector4d(6, 22, 9, 1.2);
  limits.is_clear = [&arm](const Eigen::VectorXd& q) { return tip_height_m(arm, q) > kFloor_m; };
  limits.ready_rad = Eigen::VectorXd::Zero(kElbowJoints);
  return limits;
}

TEST(ArmExcitation, KeepsEveryLimit) {
  const ArmDescription arm = elbow_with_friction();
  const ExcitationLimits limits = limits_of(arm);
  const ExcitationPlan plan = plan_for_information(arm, limits, {.motions = 2, .tries = 100});
  ASSERT_EQ(plan.motions.size(), 2U);
  EXPECT_GT(plan.refused, 0);  // the limits matter
  HiddenArm simulated(elbow_arm(), {});
  Eigen::VectorXd q(kElbowJoints), v(kElbowJoints), a(kElbowJoints);
  for (const FourierMotion& motion : plan.motions)
    for (double t = 0; t <= motion.duration_s; t += 0.01) {
      for (Eigen::Index j = 0; j < kElbowJoints; ++j) {
        const FourierMotion::State state = motion.at(j, t);
        q[j] = state.position_rad;
        v[j] = state.velocity_rad_per_s;
        a[j] = state.acceleration_rad_per_s2;
      }
      // Peaks between the samples of the planner: its highest harmonic has 20 of them.
      EXPECT_LE(q.cwiseAbs().maxCoeff(), 1.5 * 1.01);
      EXPECT_LE(v.cwiseAbs().maxCoeff(), 1.2 * 1.01);
      EXPECT_LE(a.cwiseAbs().maxCoeff(), 2 * 1.01);
      EXPECT_GT(tip_height_m(arm, q), kFloor_m - 0.02);
      const Eigen::VectorXd torque = simulated.rigid_torque_Nm(q, v, a);
      for (Eigen::Index j = 0; j < kElbowJoints; ++j) {
        const Friction& friction = simulated.friction()[static_cast<std::size_t>(j)];
        const double own = friction.coulomb_Nm * (v[j] > 0 ? 1 : -1) + friction.viscous_Nm_s_per_rad * v[j];
        EXPECT_LE(std::abs(torque[j] + own), 1.05 * limits.torque_Nm[j]) << "joint " << j << " at " << t;
      }
    }
}

/// Of the information on the links' parameters, from their torques alone: without the planner's columns.
double log_determinant(const ArmDescription& arm, const std::vector<FourierMotion>& motions) {
  identification::robot_gap::RigidArm body(arm.arm);
  Eigen::MatrixXd information = Eigen::MatrixXd::Identity(10 * kElbowJoints, 10 * kElbowJoints);
  Eigen::VectorXd q(kElbowJoints), v(kElbowJoints), a(kElbowJoints);
  Eigen::MatrixXd torque;
  for (const FourierMotion& motion : motions)
    for (double t = 0; t < motion.duration_s; t += 0.1) {
      for (Eigen::Index j = 0; j < kElbowJoints; ++j) {
        const FourierMotion::State state = motion.at(j, t);
        q[j] = state.position_rad;
        v[j] = state.velocity_rad_per_s;
        a[j] = state.acceleration_rad_per_s2;
      }
      body.move(q, v, a, arm.gravity_B_m_per_s2);
      Eigen::MatrixXd row(kElbowJoints, 10 * kElbowJoints);
      for (Eigen::Index link = 0; link < kElbowJoints; ++link) {
        body.torques(link, identification::robot_gap::InertialChanges::Identity(10, 10), torque);
        row.middleCols(10 * link, 10) = torque;
      }
      information += row.transpose() * row;
    }
  return 2 * Eigen::LLT<Eigen::MatrixXd>(information).matrixLLT().diagonal().array().log().sum();
}

TEST(ArmExcitation, IsMoreInformativeThanMotionsAtRandom) {
  const ArmDescription arm = elbow_with_friction();
  const ExcitationLimits limits = limits_of(arm);
  // One try is a motion at random within the limits, or none.
  double random = 0;
  int drawn = 0;
  for (std::uint64_t seed = 1; drawn < 5; ++seed) try {
      const ExcitationPlan plan = plan_for_information(arm, limits, {.motions = 1, .tries = 1, .seed = seed});
      random += log_determinant(arm, plan.motions) / 5;
      ++drawn;
    } catch (const std::invalid_argument&) {
    }
  const ExcitationPlan best = plan_for_information(arm, limits, {.motions = 1, .tries = 200});
  // An e-fold of the determinant for each of six parameters.
  EXPECT_GT(log_determinant(arm, best.motions), random + 6);
  const ExcitationPlan again = plan_for_information(arm, limits, {.motions = 1, .tries = 200});
  EXPECT_EQ(best.motions[0].sine_rad, again.motions[0].sine_rad);
  EXPECT_EQ(best.worth, again.worth);
}

TEST(ArmExcitation, WithoutRoomThereIsNoMotion) {
  const ArmDescription arm = elbow_with_friction();
  ExcitationLimits limits = limits_of(arm);
  limits.torque_Nm.setConstant(0.1);
  EXPECT_THROW(plan_for_information(arm, limits, {.tries = 20}), std::invalid_argument);
}

// A heavier link and a payload at the tip load the shoulder alike in most poses. What separates them is where
// the hand is while the link stays.
TEST(ArmExcitation, SeparatesRivalsBetterThanAnInformativeMotion) {
  const ArmDescription given = elbow_with_friction();
  ArmDescription heavier = given;
  heavier.arm.links[2].inertia.mass_kg *= 1.3;
  ArmDescription loaded = given;
  loaded.payload_kg = 0.2;
  const ExcitationLimits limits = limits_of(given);
  const ExcitationOptions options{.motions = 1, .tries = 200};
  const ExcitationPlan separating = plan_for_separation(given, heavier, loaded, limits, options);
  const ExcitationPlan informative = plan_for_information(given, limits, options);
  // Of joint torques of DART: what remains of the difference after each mass has been fitted to the other.
  HiddenArm plain(elbow_arm(), {});
  HiddenArm with_link(elbow_arm(), {{"link_mass", 2, 0.3}});
  HiddenArm with_payload(elbow_arm(), {{"payload", -1, 0.2}});
  const auto remains = [&](const FourierMotion& motion) {
    double ll = 0;
    double lp = 0;
    double pp = 0;
    Eigen::VectorXd q(kElbowJoints), v(kElbowJoints), a(kElbowJoints);
    for (double t = 0; t < motion.duration_s; t += 0.05) {
      for (Eigen::Index j = 0; j < kElbowJoints; ++j) {
        const FourierMotion::State state = motion.at(j, t);
        q[j] = state.position_rad;
        v[j] = state.velocity_rad_per_s;
        a[j] = state.acceleration_rad_per_s2;
      }
      const Eigen::VectorXd base = plain.rigid_torque_Nm(q, v, a);
      Eigen::VectorXd link = with_link.rigid_torque_Nm(q, v, a) - base;
      Eigen::VectorXd payload = with_payload.rigid_torque_Nm(q, v, a) - base;
      for (Eigen::Index j = 0; j < kElbowJoints; ++j) {
        const Friction& friction = plain.friction()[static_cast<std::size_t>(j)];
        const double sigma = 0.02 + 0.1 * (friction.coulomb_Nm + friction.viscous_Nm_s_per_rad);
        link[j] /= sigma;
        payload[j] /= sigma;
      }
      ll += link.squaredNorm();
      lp += link.dot(payload);
      pp += payload.squaredNorm();
    }
    return std::min(ll - lp * lp / pp, pp - lp * lp / ll);
  };
  EXPECT_GT(remains(separating.motions[0]), 1.1 * remains(informative.motions[0]));
}

TEST(ArmExcitation, EqualModelsCannotBeSeparated) {
  const ArmDescription given = elbow_with_friction();
  EXPECT_THROW(plan_for_separation(given, given, given, limits_of(given), {.motions = 1, .tries = 20}),
               std::invalid_argument);
}

}  // namespace
}  // namespace robot_gap_test
