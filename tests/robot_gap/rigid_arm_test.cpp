// Inverse dynamics and its derivatives compared with another engine, DART.
#include "identification/robot_gap/rigid_arm.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/robot_gap/hidden_arm.h"
#include "tests/robot_gap/robot_cases.h"

namespace robot_gap_test {
namespace {

using identification::robot_gap::InertialChanges;
using identification::robot_gap::InertialVector;
using identification::robot_gap::RigidArm;

constexpr double kTolerance = 1e-9;  // relative, and absolute in N·m

class RigidArmAndDart : public testing::TestWithParam<const char*> {
 protected:
  RigidArmAndDart()
      : design_(std::string(GetParam()) == "planar" ? planar_arm() : industrial_arm()),
        dart_(design_, {}),
        arm_(control::read_serial_arm(urdf_of(design_), "base", "tip")) {}
  Eigen::VectorXd random_vector() {
    Eigen::VectorXd result(static_cast<Eigen::Index>(design_.bodies.size()));
    for (double& one : result) one = std::uniform_real_distribution<double>(-2, 2)(random_);
    return result;
  }

  ArmDesign design_;
  HiddenArm dart_;
  control::SerialArm arm_;
  std::mt19937_64 random_{5};
};

TEST_P(RigidArmAndDart, AgreeOnTheTorqueOfEveryMotion) {
  RigidArm ours(arm_);
  std::vector<InertialVector> links;
  for (const control::ArmLink& link : arm_.links)
    links.push_back(identification::robot_gap::inertial_vector(link.inertia));
  for (int i = 0; i < 100; ++i) {
    const Eigen::VectorXd q = random_vector(), v = random_vector(), a = random_vector();
    ours.move(q, v, a, {0, 0, -9.81});
    Eigen::VectorXd torque_Nm;
    ours.torques(links, torque_Nm);
    const Eigen::VectorXd expected_Nm = dart_.rigid_torque_Nm(q, v, a);
    EXPECT_LT((torque_Nm - expected_Nm).norm(), kTolerance * (1 + expected_Nm.norm()));
  }
}

TEST_P(RigidArmAndDart, TorquesAreASumOverTheParametersOfTheLinks) {
  RigidArm ours(arm_);
  const Eigen::VectorXd q = random_vector(), v = random_vector(), a = random_vector();
  ours.move(q, v, a, {1, 2, -9});
  std::vector<InertialVector> links;
  Eigen::VectorXd sum_Nm = Eigen::VectorXd::Zero(ours.joints());
  for (Eigen::Index link = 0; link < ours.joints(); ++link) {
    links.emplace_back(InertialVector::Random());
    Eigen::MatrixXd columns;
    ours.torques(link, InertialChanges(links.back()), columns);
    sum_Nm += columns;
  }
  Eigen::VectorXd torque_Nm;
  ours.torques(links, torque_Nm);
  EXPECT_LT((torque_Nm - sum_Nm).norm(), kTolerance * (1 + sum_Nm.norm()));
}

INSTANTIATE_TEST_SUITE_P(Arms, RigidArmAndDart, testing::Values("planar", "industrial"));

}  // namespace
}  // namespace robot_gap_test
