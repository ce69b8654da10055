// Kinematics and dynamics of base and arm against geometry by hand, derivatives by differences, and general
// laws of mechanics. robot_model_dart_test.cpp compares with another engine.
#include "control/robot_model.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include "tests/support/no_alloc_guard.h"

namespace robot_model_test {

using control::ChainMatrix;
using control::ChainVector;
using control::kArmJoints;
using control::kBaseAxes;
using control::kChainAxes;
using control::Link;
using control::ModelChanges;
using control::RobotModel;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kGravity_m_per_s2 = 9.81;
constexpr std::array kLinks = {Link::kBase, Link::kArm1, Link::kArm2, Link::kArm3, Link::kArm4, Link::kArm5};

/// The arm's joints, 2 to 4 counted from where the arm points straight up, and the base at the origin.
ChainVector pose(double joint_2_deg, double joint_3_deg, double joint_4_deg) {
  ChainVector q;
  q << 0, 0, 0, 169, 65 + joint_2_deg, -146 + joint_3_deg, 102.5 + joint_4_deg, 167.5;
  q.tail<kArmJoints>() *= kDegree;
  return q;
}
const ChainVector kCandle = pose(0, 0, 0);

/// Deterministic states anywhere between the end stops.
class Any {
 public:
  ChainVector position(const RobotModel& model) {
    ChainVector q;
    for (int i = 0; i < kBaseAxes; ++i) q[i] = between(-3, 3);
    for (std::size_t j = 0; j < kArmJoints; ++j)
      q[kBaseAxes + static_cast<int>(j)] = between(model.ranges()[j].lower_rad, model.ranges()[j].upper_rad);
    return q;
  }
  ChainVector velocity() {
    return ChainVector::NullaryExpr([&] { return between(-2, 2); });
  }
  Vector3d point() {
    return Vector3d::NullaryExpr([&] { return between(-0.3, 0.3); });
  }

 private:
  double between(double lower, double upper) {
    return std::uniform_real_distribution<double>(lower, upper)(random_);
  }
  std::mt19937 random_{7};
};

/// Derivative of f with respect to q along v, by a difference with an error below 1e-9 for values of order
/// one.
template <class Function>
auto derivative_along(const ChainVector& v, const ChainVector& q, Function f) {
  constexpr double kStep = 1e-5;
  const auto ahead = f(ChainVector(q + kStep * v));
  const auto behind = f(ChainVector(q - kStep * v));
  return ((ahead - behind) / (2 * kStep)).eval();
}

std::string changed_text(const std::string& from, const std::string& to) {
  std::string text(control::youbot_urdf());
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("not in the description: " + from);
  return text.replace(at, from.size(), to);
}
std::string refusal(const std::string& urdf) {
  try {
    RobotModel model({}, urdf);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}
std::string refusal(const ModelChanges& changes) {
  try {
    RobotModel model(changes);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

TEST(RobotModel, AtTheCandleTheTipStandsStraightAboveJoint5) {
  RobotModel model;
  model.update(kCandle);
  // Foot, joints 2 and 5 forward; floor to foot, and 0.096 + 0.019 + 0.155 + 0.135 + 0.2175 m of arm.
  EXPECT_NEAR(model.X_WT().translation().x(), 0.143 + 0.024 + 0.033 - 0.002, 1e-12);
  EXPECT_NEAR(model.X_WT().translation().y(), 0, 1e-12);
  EXPECT_NEAR(model.X_WT().translation().z(), 0.084 + 0.046 + 0.6225, 1e-12);
  EXPECT_TRUE(model.X_WT().linear().isIdentity(1e-12)) << model.X_WT().linear();
}

TEST(RobotModel, Joints2To4BendForwardAndJoint1And5TurnClockwise) {
  RobotModel model;
  model.update(pose(90, 0, 0));  // straight ahead
  EXPECT_TRUE(model.X_WT().translation().isApprox(Vector3d(0.2 + 0.5075, 0, 0.245 + 0.002), 1e-12));
  model.update(pose(0, 90, 0));
  EXPECT_TRUE(model.X_WT().translation().isApprox(Vector3d(0.2 + 0.3525, 0, 0.245 + 0.155 + 0.002), 1e-12));
  model.update(pose(0, 0, 90));
  EXPECT_TRUE(model.X_WT().translation().isApprox(Vector3d(0.2 + 0.2175, 0, 0.245 + 0.29 + 0.002), 1e-12));

  ChainVector q = pose(90, 0, 0);
  q[kBaseAxes] += 90 * kDegree;  // to the right
  model.update(q);
  EXPECT_TRUE(model.X_WT().translation().isApprox(Vector3d(0.143 + 0.024, -0.033 - 0.5075, 0.247), 1e-12));
  q = kCandle;
  q[kBaseAxes + 4] += 90 * kDegree;
  model.update(q);
  EXPECT_TRUE(model.X_WT().linear().col(0).isApprox(-Vector3d::UnitY(), 1e-12));
}

TEST(RobotModel, TheBaseCarriesTheArmAlong) {
  RobotModel model;
  ChainVector q = kCandle;
  q.head<kBaseAxes>() << 2, -1, 90 * kDegree;
  model.update(q);
  EXPECT_TRUE(model.X_WT().translation().isApprox(Vector3d(2, -1 + 0.198, 0.7525), 1e-12));
  EXPECT_TRUE(model.X_WT().linear().col(0).isApprox(Vector3d::UnitY(), 1e-12));
  EXPECT_TRUE(model.X_WL(Link::kBase).translation().isApprox(Vector3d(2, -1, 0), 1e-12));
  EXPECT_TRUE(model.X_WL(Link::kArm2).translation().isApprox(Vector3d(2, -1 + 0.2, 0.245), 1e-12));
}

/// Joints 2 to 4 from where the arm points straight up, with the elbow up, that put T in the plane ahead with
/// z `pitch_rad` from upright. Lengths as in the operating instructions.
Vector3d planar_inverse_rad(double x_m, double z_m, double pitch_rad) {
  const double s = std::sin(pitch_rad), c = std::cos(pitch_rad);
  const double ahead_m = x_m - (-0.002 * c + 0.2175 * s) - 0.2;  // of joint 4 from joint 2
  const double up_m = z_m - (0.002 * s + 0.2175 * c) - 0.245;
  const double elbow_rad =
      std::acos((ahead_m * ahead_m + up_m * up_m - 0.155 * 0.155 - 0.135 * 0.135) / (2 * 0.155 * 0.135));
  const double shoulder_rad = std::atan2(ahead_m, up_m) -
                              std::atan2(0.135 * std::sin(elbow_rad), 0.155 + 0.135 * std::cos(elbow_rad));
  return {shoulder_rad, elbow_rad, pitch_rad - shoulder_rad - elbow_rad};
}
bool between_stops(const RobotModel& model, const ChainVector& q) {
  for (std::size_t j = 0; j < kArmJoints; ++j) {
    const double q_rad = q[kBaseAxes + static_cast<int>(j)];
    if (q_rad < model.ranges()[j].lower_rad || q_rad > model.ranges()[j].upper_rad) return false;
  }
  return true;
}

// The thesis' first set-point is (0.35, 0, 0.35) with T turned by 135 degrees about y. Joint 4 stops short
// of that; 120 degrees are reached, and from 0.30 m downwards the 135.
TEST(RobotModel, TheThesisSetPointIsReachedUpToTheStopOfJoint4) {
  RobotModel model;
  struct Case {
    double z_m, pitch_deg;
    bool reached;
  };
  for (const Case c : {Case{0.35, 135, false}, {0.35, 120, true}, {0.30, 135, true}}) {
    const Vector3d bend_deg = planar_inverse_rad(0.35, c.z_m, c.pitch_deg * kDegree) / kDegree;
    const ChainVector q = pose(bend_deg[0], bend_deg[1], bend_deg[2]);
    EXPECT_EQ(between_stops(model, q), c.reached) << c.z_m << " m, " << c.pitch_deg << " deg: " << bend_deg;
    model.update(q);
    EXPECT_TRUE(model.X_WT().translation().isApprox(Vector3d(0.35, 0, c.z_m), 1e-12));
    const Eigen::AngleAxisd turn(c.pitch_deg * kDegree, Vector3d::UnitY());
    EXPECT_TRUE(model.X_WT().linear().isApprox(turn.toRotationMatrix(), 1e-12));
  }
}

TEST(RobotModel, RangesAreThoseOfTheDescriptionWithTheCandleInsideThem) {
  const RobotModel model;
  const std::array<double, kArmJoints> lower_deg = {0, 0, -297, 0, 0};
  const std::array<double, kArmJoints> upper_deg = {338, 155, 0, 205, 335};
  for (std::size_t j = 0; j < kArmJoints; ++j) {
    EXPECT_NEAR(model.ranges()[j].lower_rad, lower_deg[j] * kDegree, 1e-12);
    EXPECT_NEAR(model.ranges()[j].upper_rad, upper_deg[j] * kDegree, 1e-12);
  }
  EXPECT_TRUE(between_stops(model, kCandle));
}

TEST(RobotModel, JacobiansAreTheDerivativesOfWhereThingsAre) {
  RobotModel model, moved;
  Any any;
  for (int i = 0; i < 50; ++i) {
    const ChainVector q = any.position(model), v = any.velocity();
    model.update(q);
    const Eigen::Matrix<double, 6, 1> twist = model.J_WT() * v;
    const auto p_WT = [&](const ChainVector& at) {
      moved.update(at);
      return Vector3d(moved.X_WT().translation());
    };
    const auto R_WT = [&](const ChainVector& at) {
      moved.update(at);
      return Eigen::Matrix3d(moved.X_WT().linear());
    };
    EXPECT_LT((derivative_along(v, q, p_WT) - twist.head<3>()).norm(), 1e-7);
    const Eigen::Matrix3d w_cross = derivative_along(v, q, R_WT) * model.X_WT().linear().transpose();
    EXPECT_LT((Vector3d(w_cross(2, 1), w_cross(0, 2), w_cross(1, 0)) - twist.tail<3>()).norm(), 1e-7);

    for (const Link link : kLinks) {
      const Vector3d p_L = any.point();
      const auto p_WP = [&](const ChainVector& at) {
        moved.update(at);
        return Vector3d(moved.X_WL(link) * p_L);
      };
      const Vector3d velocity = model.point_jacobian(link, model.X_WL(link) * p_L) * v;
      EXPECT_LT((derivative_along(v, q, p_WP) - velocity).norm(), 1e-7) << static_cast<int>(link);
    }
  }
}

TEST(RobotModel, TheMassMatrixIsThatOfARealMechanism) {
  RobotModel model;
  Any any;
  for (int i = 0; i < 100; ++i) {
    model.update(any.position(model));
    const ChainMatrix M = model.mass();
    EXPECT_EQ(M, M.transpose());
    EXPECT_EQ(Eigen::LLT<ChainMatrix>(M).info(), Eigen::Success);
    // Pushed without the arm's joints moving it is one body.
    EXPECT_NEAR(M(0, 0), model.total_mass_kg(), 1e-12);
    EXPECT_NEAR(M(1, 1), model.total_mass_kg(), 1e-12);
    EXPECT_NEAR(M(0, 1), 0, 1e-12);
  }
}

TEST(RobotModel, TheRobotWeighsItsParts) {
  // Base, wheels, foot, links 1 to 5, gripper.
  EXPECT_NEAR(RobotModel().total_mass_kg(),
              22 + 4 * 0.4 + 0.845 + 2.412 + 1.155 + 0.934 + 0.877 + 0.251 + 0.245, 1e-12);
}

TEST(RobotModel, GravityAtTheStretchedArmIsItsWeightTimesItsLevers) {
  RobotModel model;
  model.update(pose(90, 0, 0));
  // First moments about joints 4, 3 and 2, from the table of the description.
  const double joint_4_kg_m = 0.877 * 0.05103 + 0.251 * (0.130 - 0.03323) + 0.245 * (0.130 + 0.0289);
  const double joint_3_kg_m = joint_4_kg_m + 0.934 * 0.0967 + (0.877 + 0.251 + 0.245) * 0.135;
  const double joint_2_kg_m = joint_3_kg_m + 1.155 * 0.10453 + (0.934 + 0.877 + 0.251 + 0.245) * 0.155;
  ChainVector expected = ChainVector::Zero();
  // Weight bends forward; what holds it bends back.
  expected.segment<3>(kBaseAxes + 1) =
      -kGravity_m_per_s2 * Vector3d(joint_2_kg_m, joint_3_kg_m, joint_4_kg_m);
  // The hand is 1.15 mm to one side, which joint 5 in its middle holds upright.
  EXPECT_NEAR(model.gravity_Nm()[kBaseAxes + 4], 0.251 * 0.00115 * kGravity_m_per_s2, 3e-3);
  EXPECT_LT((model.gravity_Nm() - expected).head<7>().norm(), 1e-12) << model.gravity_Nm().transpose();
  EXPECT_NEAR(-model.gravity_Nm()[kBaseAxes + 1], 8.46, 0.01);  // N·m, of the 9.5 that the joint has
}

TEST(RobotModel, AtTheCandleTheJointsHoldNextToNothing) {
  RobotModel model;
  model.update(kCandle);
  EXPECT_LT(model.gravity_Nm().norm(), 0.1);
}

TEST(RobotModel, WhatTurnsTheChainAboutTheVerticalOrMovesItOnTheFloorHoldsNoWeight) {
  RobotModel model;
  Any any;
  for (int i = 0; i < 20; ++i) {
    model.update(any.position(model));
    EXPECT_LT(model.gravity_Nm().head<4>().norm(), 1e-12);
  }
}

/// Acceleration of the chain left to itself.
ChainVector falling(RobotModel& model, const ChainVector& q, const ChainVector& v) {
  model.update(q);
  return model.mass().ldlt().solve(-model.coriolis_Nm(v) - model.gravity_Nm());
}

TEST(RobotModel, CoriolisForcesAreWhatTheChangeOfTheMassMatrixAsksFor) {
  // c = Mdot v - grad (v' M v) / 2, with Lagrange.
  RobotModel model, moved;
  Any any;
  for (int i = 0; i < 20; ++i) {
    const ChainVector q = any.position(model), v = any.velocity();
    const auto M = [&](const ChainVector& at) {
      moved.update(at);
      return moved.mass();
    };
    ChainVector expected = derivative_along(v, q, M) * v;
    for (int j = 0; j < kChainAxes; ++j)
      expected[j] -= v.dot(derivative_along(ChainVector::Unit(j), q, M) * v) / 2;
    model.update(q);
    const ChainVector c = model.coriolis_Nm(v);
    EXPECT_LT((c - expected).norm(), 1e-7 * (1 + c.norm()));
    // So a motion takes no work from them that does not go into the mass matrix.
    EXPECT_NEAR(v.dot(derivative_along(v, q, M) * v), 2 * v.dot(c), 1e-7 * (1 + c.norm() * v.norm()));
  }
}

TEST(RobotModel, AtRestThereAreNoCoriolisForcesAndTheyGrowWithTheSquareOfSpeed) {
  RobotModel model;
  Any any;
  model.update(any.position(model));
  const ChainVector v = any.velocity();
  EXPECT_EQ(model.coriolis_Nm(ChainVector::Zero()), ChainVector(ChainVector::Zero()));
  EXPECT_TRUE(model.coriolis_Nm(3 * v).isApprox(9 * model.coriolis_Nm(v), 1e-12));
}

TEST(RobotModel, FallingFreelyItKeepsItsEnergy) {
  RobotModel model;
  Any any;
  // The error of Runge and Kutta's method over 0.2 s at this step, with half of the step.
  const auto energy_error_J = [&](ChainVector q, ChainVector v, int steps) {
    const double h = 0.2 / steps;
    const auto kinetic_J = [&] {
      model.update(q);
      return v.dot(model.mass() * v) / 2;
    };
    const double before_J = kinetic_J();
    double work_J = 0;  // of the weight, integrated with the motion
    const auto power_W = [&](const ChainVector& at, const ChainVector& velocity) {
      model.update(at);
      return -model.gravity_Nm().dot(velocity);
    };
    for (int i = 0; i < steps; ++i) {
      const ChainVector a1 = falling(model, q, v);
      const ChainVector q2 = q + h / 2 * v, v2 = v + h / 2 * a1, a2 = falling(model, q2, v2);
      const ChainVector q3 = q + h / 2 * v2, v3 = v + h / 2 * a2, a3 = falling(model, q3, v3);
      const ChainVector q4 = q + h * v3, v4 = v + h * a3, a4 = falling(model, q4, v4);
      work_J += h / 6 * (power_W(q, v) + 2 * power_W(q2, v2) + 2 * power_W(q3, v3) + power_W(q4, v4));
      q += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
      v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
    return std::abs(kinetic_J() - before_J - work_J);
  };
  for (int i = 0; i < 5; ++i) {
    const ChainVector q = any.position(model), v = any.velocity() / 2;
    const double coarse_J = energy_error_J(q, v, 400), fine_J = energy_error_J(q, v, 800);
    EXPECT_LT(fine_J, 1e-6);
    EXPECT_LT(fine_J, coarse_J / 8 + 1e-9) << "does not vanish with the step: " << coarse_J << ", " << fine_J;
  }
}

TEST(RobotModel, GravityIsTheSlopeOfAnEnergy) {
  // Forces that come from an energy change alike across: their Jacobian is symmetric.
  RobotModel model, moved;
  Any any;
  for (int i = 0; i < 20; ++i) {
    const ChainVector q = any.position(model);
    ChainMatrix slope;
    for (int j = 0; j < kChainAxes; ++j)
      slope.col(j) = derivative_along(ChainVector::Unit(j), q, [&](const ChainVector& at) {
        moved.update(at);
        return moved.gravity_Nm();
      });
    EXPECT_LT((slope - slope.transpose()).norm(), 1e-7);
  }
}

TEST(RobotModel, ALinkMadeHeavierCarriesMoreAtTheSamePlace) {
  ModelChanges changes;
  changes.links[static_cast<std::size_t>(Link::kArm3)].mass_factor = 1.5;
  RobotModel model, heavier(changes);
  EXPECT_NEAR(heavier.total_mass_kg() - model.total_mass_kg(), 0.934 / 2, 1e-12);
  for (RobotModel* m : {&model, &heavier}) m->update(pose(90, 0, 0));
  const ChainVector more_Nm = heavier.gravity_Nm() - model.gravity_Nm();
  EXPECT_NEAR(more_Nm[kBaseAxes + 1], -0.934 / 2 * (0.155 + 0.0967) * kGravity_m_per_s2, 1e-12);
  EXPECT_NEAR(more_Nm[kBaseAxes + 2], -0.934 / 2 * 0.0967 * kGravity_m_per_s2, 1e-12);
  EXPECT_NEAR(more_Nm[kBaseAxes + 3], 0, 1e-12);
  // About joint 3: half again the link's tensor about its centre, and its weight at its lever.
  EXPECT_NEAR((heavier.mass() - model.mass())(kBaseAxes + 2, kBaseAxes + 2),
              (0.002571 + 0.934 * (0.0967 * 0.0967 + 0.0001 * 0.0001)) / 2, 1e-12);
}

TEST(RobotModel, ACentreOfMassIsShiftedInTheLinksFrameWithoutTheTensor) {
  ModelChanges changes;
  changes.links[static_cast<std::size_t>(Link::kArm3)].com_shift_m = {0.01, 0, 0.02};
  RobotModel model, shifted(changes);
  EXPECT_NEAR(shifted.total_mass_kg(), model.total_mass_kg(), 1e-12);
  for (RobotModel* m : {&model, &shifted}) m->update(pose(90, 0, 0));
  // Stretched ahead, z of the link points ahead and x down.
  EXPECT_NEAR((shifted.gravity_Nm() - model.gravity_Nm())[kBaseAxes + 2], -0.934 * 0.02 * kGravity_m_per_s2,
              1e-12);
  EXPECT_NEAR((shifted.mass() - model.mass())(kBaseAxes + 2, kBaseAxes + 2),
              0.934 * (0.1167 * 0.1167 + 0.0099 * 0.0099 - 0.0967 * 0.0967 - 0.0001 * 0.0001), 1e-12);
}

TEST(RobotModel, APayloadHangsAtTheTip) {
  ModelChanges changes;
  changes.payload_kg = 0.5;
  RobotModel model, loaded(changes);
  EXPECT_NEAR(loaded.total_mass_kg() - model.total_mass_kg(), 0.5, 1e-12);
  for (RobotModel* m : {&model, &loaded}) m->update(pose(90, 0, 0));
  const ChainVector more_Nm = loaded.gravity_Nm() - model.gravity_Nm();
  EXPECT_NEAR(more_Nm[kBaseAxes + 1], -0.5 * 0.5075 * kGravity_m_per_s2, 1e-12);
  EXPECT_NEAR(more_Nm[kBaseAxes + 2], -0.5 * 0.3525 * kGravity_m_per_s2, 1e-12);
  EXPECT_NEAR(more_Nm[kBaseAxes + 3], -0.5 * 0.2175 * kGravity_m_per_s2, 1e-12);
  // A point mass adds exactly J' m J.
  const auto J = model.J_WT().topRows<3>();
  EXPECT_LT((loaded.mass() - model.mass() - 0.5 * J.transpose() * J).norm(), 1e-12);
}

TEST(RobotModel, APayloadBesideTheTipHangsAtItsPlace) {
  ModelChanges changes;
  changes.payload_kg = 1.0;
  changes.payload_p_T_m = {0.02, 0, 0.05};
  RobotModel model, loaded(changes);
  for (RobotModel* m : {&model, &loaded}) m->update(pose(90, 0, 0));
  // Stretched ahead: z of T points ahead and x down, which changes no lever of a weight.
  const ChainVector more_Nm = loaded.gravity_Nm() - model.gravity_Nm();
  EXPECT_NEAR(more_Nm[kBaseAxes + 1], -1.0 * (0.5075 + 0.05) * kGravity_m_per_s2, 1e-12);
  EXPECT_NEAR(more_Nm[kBaseAxes + 3], -1.0 * (0.2175 + 0.05) * kGravity_m_per_s2, 1e-12);
  // Joint 5 is 2 mm behind joint 4, along x of T.
  EXPECT_NEAR((loaded.mass() - model.mass())(kBaseAxes + 3, kBaseAxes + 3), 0.2675 * 0.2675 + 0.018 * 0.018,
              1e-12);
}

TEST(RobotModel, AChangedTensorChangesTheInertiaAloneWhateverTheMass) {
  ModelChanges changes;
  changes.links[static_cast<std::size_t>(Link::kArm3)].inertia_change_kg_m2(1, 1) = 0.002;
  RobotModel model, changed(changes);
  for (RobotModel* m : {&model, &changed}) m->update(pose(90, 0, 0));
  EXPECT_LT((changed.gravity_Nm() - model.gravity_Nm()).norm(), 1e-12);
  EXPECT_NEAR((changed.mass() - model.mass())(kBaseAxes + 2, kBaseAxes + 2), 0.002, 1e-12);
  changes.links[static_cast<std::size_t>(Link::kArm3)].inertia_change_kg_m2(1, 1) = -0.003;
  EXPECT_NE(refusal(changes).find("no moment of inertia of arm link 3 may be negative"), std::string::npos)
      << refusal(changes);
}

TEST(RobotModel, RefusesChangesThatNoRobotCanHave) {
  for (const double bad :
       {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    ModelChanges changes;
    changes.links[3].mass_factor = bad;
    EXPECT_NE(refusal(changes).find("mass_factor of arm link 3 must be finite and positive, not " +
                                    std::to_string(bad)),
              std::string::npos)
        << refusal(changes);
  }
  ModelChanges changes;
  changes.links[0].com_shift_m.y() = std::numeric_limits<double>::infinity();
  EXPECT_NE(refusal(changes).find("com_shift_m of the base must be finite"), std::string::npos);
  changes = {};
  changes.payload_p_T_m.z() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal(changes).find("payload_p_T_m must be finite"), std::string::npos);
  changes = {};
  changes.payload_kg = -0.1;
  EXPECT_NE(refusal(changes).find("payload_kg must be finite and not negative, not -0.1"), std::string::npos);
}

TEST(RobotModel, RefusesADescriptionThatIsNotSuchAChainAndSaysWhy) {
  struct Case {
    std::string urdf, reason;
  };
  const std::string text(control::youbot_urdf());
  for (const Case& c : {
           Case{"", "not a URDF"},
           {"<robot", "not a URDF"},
           {text.substr(0, text.size() / 2), "not a URDF"},
           {changed_text("<link name=\"tip\"/>", "<link name=\"top\"/>"), "not a URDF"},
           {"<robot name=\"r\"><link name=\"l\"/></robot>", "no link called tip"},
           {"<robot name=\"r\"><link name=\"tip\"/></robot>", "0 do, and 0 of them there"},
           {changed_text("wheel_rear_left_joint\" type=\"fixed\"",
                         "wheel_rear_left_joint\" type=\"continuous\""),
            "9 do, and 8 of them there"},
           {changed_text("gripper_joint\" type=\"fixed\"", "gripper_joint\" type=\"floating\""),
            "9 do, and 8 of them there"},
           {changed_text("arm_joint_3\" type=\"revolute\"", "arm_joint_3\" type=\"prismatic\""),
            "joint arm_joint_3 should turn"},
           {changed_text("base_y\" type=\"prismatic\"", "base_y\" type=\"revolute\""),
            "joint base_y should slide"},
           {changed_text("<axis xyz=\"1 0 0\"/>", "<axis xyz=\"0 1 0\"/>"), "joint base_x should be along x"},
           {changed_text("upper=\"2.705260340591211\"", "upper=\"-1\""),
            "joint arm_joint_2 has no lower limit"},
           {changed_text("<mass value=\"0.934\"/>", "<mass value=\"-0.934\"/>"),
            "what joint arm_joint_3 moves should weigh something, not -0.934"},
       })
    EXPECT_NE(refusal(c.urdf).find(c.reason), std::string::npos)
        << refusal(c.urdf) << " instead of " << c.reason;
}

TEST(RobotModel, TheCycleDoesNotAllocate) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  RobotModel model;
  Any any;
  const ChainVector q = any.position(model), v = any.velocity();
  double sum = 0;
  const support::NoAllocGuard guard;
  model.update(q);
  sum += model.X_WT().translation().sum() + model.J_WT().sum() + model.X_WL(Link::kArm4).translation().sum();
  sum += model.point_jacobian(Link::kArm2, {0.1, 0.2, 0.3}).sum();
  sum += model.mass().sum() + model.gravity_Nm().sum() + model.coriolis_Nm(v).sum();
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace robot_model_test
