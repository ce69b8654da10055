#include "identification/robot_gap/base_parameters.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>

#include "identification/robot_gap/link_motion.h"
#include "identification/robot_gap/rigid_arm.h"

namespace identification::robot_gap {
namespace {

/// Random states: each gives a torque of every joint, some times as many as there are parameters.
constexpr int kStates = 100;
constexpr std::uint64_t kStateSeed = 1;
/// Of the largest: smaller diagonal entries of R, and smaller multiples, are rounding.
constexpr double kZero = 1e-9;

constexpr std::array kLinkParameters{
    "mass_kg",          "moment_x_kg_m",    "moment_y_kg_m",    "moment_z_kg_m",    "inertia_xx_kg_m2",
    "inertia_xy_kg_m2", "inertia_xz_kg_m2", "inertia_yy_kg_m2", "inertia_yz_kg_m2", "inertia_zz_kg_m2"};

/// Torques of all joints by all parameters, joints · states × parameters.
Eigen::MatrixXd torques_in_random_states(const control::ArmDescription& arm) {
  RigidArm body(arm.arm);
  const Eigen::Index joints = body.joints();
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(kStates * joints, 11 * joints);
  std::mt19937_64 random(kStateSeed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto draw = [&](double most) {
    return Eigen::VectorXd::NullaryExpr(joints, [&] { return most * uniform(random); }).eval();
  };
  Eigen::MatrixXd torque;
  for (int state = 0; state < kStates; ++state) {
    const Eigen::VectorXd q = draw(std::numbers::pi);
    const Eigen::VectorXd v = draw(3);
    const Eigen::VectorXd a = draw(10);
    body.move(q, v, a, arm.gravity_B_m_per_s2);
    for (Eigen::Index link = 0; link < joints; ++link) {
      body.torques(link, InertialChanges::Identity(10, 10), torque);
      all.block(state * joints, 10 * link, joints, 10) = torque;
      all(state * joints + link, 10 * joints + link) = a[link];  // the rotor
    }
  }
  return all;
}

std::string parameter_name(const control::ArmDescription& arm, Eigen::Index parameter) {
  const auto links = static_cast<Eigen::Index>(arm.arm.links.size());
  if (parameter >= 10 * links)
    return "rotor_inertia_kg_m2 of " + arm.drives[static_cast<std::size_t>(parameter - 10 * links)].joint;
  return std::string(kLinkParameters[static_cast<std::size_t>(parameter % 10)]) + " of " +
         arm.arm.links[static_cast<std::size_t>(parameter / 10)].link;
}

}  // namespace

BaseParameters::BaseParameters(const control::ArmDescription& arm) {
  const Eigen::MatrixXd torques = torques_in_random_states(arm);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(torques);
  const Eigen::MatrixXd r = qr.matrixR().topRows(torques.cols()).triangularView<Eigen::Upper>();
  Eigen::Index rank = 0;
  while (rank < r.rows() && std::abs(r(rank, rank)) > kZero * std::abs(r(0, 0))) ++rank;
  Eigen::MatrixXd multiples = Eigen::MatrixXd::Identity(rank, r.cols());
  multiples.rightCols(r.cols() - rank) = r.topLeftCorner(rank, rank)
                                             .triangularView<Eigen::Upper>()
                                             .solve(r.topRightCorner(rank, r.cols() - rank));
  multiples = (multiples.array().abs() > kZero).select(multiples, 0.0).eval();
  combine_ = multiples * qr.colsPermutation().transpose();
  for (Eigen::Index k = 0; k < rank; ++k) {
    const auto others = (multiples.row(k).array() != 0).count() - 1;
    names_.push_back(parameter_name(arm, qr.colsPermutation().indices()[k]) +
                     (others == 0 ? "" : ", with " + std::to_string(others) + " others"));
  }
}

Eigen::VectorXd BaseParameters::of(const control::ArmDescription& arm) const {
  return combine_ * inertial_parameters(arm);
}

Eigen::VectorXd inertial_parameters(const control::ArmDescription& arm) {
  const std::vector<InertialVector> links = inertial_vectors(arm);
  const auto joints = static_cast<Eigen::Index>(links.size());
  Eigen::VectorXd all(11 * joints);
  for (Eigen::Index i = 0; i < joints; ++i) {
    all.segment<10>(10 * i) = links[static_cast<std::size_t>(i)];
    all[10 * joints + i] = arm.drives[static_cast<std::size_t>(i)].rotor_inertia_kg_m2;
  }
  return all;
}

}  // namespace identification::robot_gap
