#include "tests/robot_gap/hidden_arm.h"

#include <algorithm>
#include <cmath>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <numbers>
#include <random>
#include <sstream>

namespace robot_gap_test {
namespace {

using dart::dynamics::BodyNode;
using dart::dynamics::RevoluteJoint;

constexpr double kEncoderStep_rad = 2e-5;
constexpr double kTorqueSteps = 2000;  // to the largest torque

std::string three(const Eigen::Vector3d& v) {
  std::ostringstream text;
  text.precision(12);
  text << v.x() << ' ' << v.y() << ' ' << v.z();
  return text.str();
}

double sign_of(double v) { return v > 0 ? 1 : (v < 0 ? -1 : 0); }

/// Sums of sines with random phases.
struct Sines {
  std::vector<double> amplitude, rate, phase;
  double mean = 0;
  Eigen::Vector3d at(double t) const {  // angle, velocity, acceleration
    Eigen::Vector3d result(mean, 0, 0);
    for (std::size_t k = 0; k < rate.size(); ++k) {
      const double w = rate[k];
      const double s = std::sin(w * t + phase[k]);
      const double c = std::cos(w * t + phase[k]);
      result += amplitude[k] * Eigen::Vector3d(s, w * c, -w * w * s);
    }
    return result;
  }
};

std::vector<Sines> motion_of(const ArmDesign& design, const RecordingPlan& plan) {
  std::mt19937_64 random(plan.seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Sines> motion(design.bodies.size());
  for (Sines& joint : motion) {
    joint.mean = 0.6 * (uniform(random) - 0.5);
    constexpr int kTones = 5;
    for (int k = 0; k < kTones; ++k) {
      const double share = (k + uniform(random)) / kTones;
      const double hertz =
          plan.tempo * design.slowest_Hz * std::pow(design.fastest_Hz / design.slowest_Hz, share);
      joint.rate.push_back(2 * std::numbers::pi * hertz);
      joint.phase.push_back(2 * std::numbers::pi * uniform(random));
      joint.amplitude.push_back(design.amplitude_rad / kTones * (1.6 - share));
    }
  }
  return motion;
}

}  // namespace

ArmDesign planar_arm() {
  return {"planar",
          {{{0, 0, 1}, {0, 1, 0}, 2.1, {0, 0, -0.21}, {0.03, 0.031, 0.004}},
           {{0, 0, -0.4}, {0, 1, 0}, 1.3, {0, 0, -0.17}, {0.012, 0.0125, 0.002}}},
          {0, 0, -0.35},
          0.1,
          1.0,
          1.6};
}

ArmDesign elbow_arm() {
  return {"elbow",
          {{{0, 0, 0.2}, {0, 0, 1}, 3.0, {0.01, 0.02, 0.06}, {0.02, 0.022, 0.015}},
           {{0.05, 0, 0.15}, {0, 1, 0}, 2.4, {0.02, 0.01, 0.16}, {0.03, 0.033, 0.006}},
           {{0, 0, 0.35}, {0, 1, 0}, 1.5, {0.015, -0.01, 0.12}, {0.011, 0.012, 0.003}},
           {{0, 0, 0.3}, {1, 0, 0}, 0.6, {0.01, 0.005, 0.05}, {0.0015, 0.0017, 0.0009}}},
          {0.02, 0, 0.14},
          0.1,
          1.0,
          1.3};
}

ArmDesign industrial_arm() {
  return {"industrial",
          {{{0, 0, 0.3}, {0, 0, 1}, 8.0, {0.02, -0.03, 0.05}, {0.09, 0.08, 0.07}},
           {{0.1, 0, 0.2}, {0, 1, 0}, 7.0, {0.03, 0.04, 0.24}, {0.16, 0.17, 0.03}},
           {{0, 0, 0.5}, {0, 1, 0}, 4.5, {0.06, -0.02, 0.08}, {0.04, 0.05, 0.03}},
           {{0.15, 0, 0.08}, {1, 0, 0}, 2.5, {0.18, 0.01, 0}, {0.006, 0.022, 0.021}},
           {{0.32, 0, 0}, {0, 1, 0}, 1.2, {0.03, 0.005, -0.01}, {0.002, 0.0024, 0.002}},
           {{0.09, 0, 0}, {1, 0, 0}, 0.5, {0.03, 0.006, 0.004}, {0.0006, 0.0005, 0.0005}}},
          {0.1, 0, 0},
          0.08,
          0.8,
          1.2};
}

std::string urdf_of(const ArmDesign& design) {
  std::ostringstream text;
  text.precision(12);
  text << "<robot name='" << design.name << "'>\n<link name='base'/>\n";
  for (std::size_t i = 0; i < design.bodies.size(); ++i) {
    const ArmDesign::Body& body = design.bodies[i];
    const std::string number = std::to_string(i + 1);
    const Eigen::Vector3d& inertia = body.inertia_kg_m2;
    text << "<link name='link" << number << "'><inertial><origin xyz='" << three(body.centre_m)
         << "'/><mass value='" << body.mass_kg << "'/><inertia ixx='" << inertia.x() << "' iyy='"
         << inertia.y() << "' izz='" << inertia.z()
         << "' ixy='0' ixz='0' iyz='0'/></inertial></link>\n<joint name='joint" << number
         << "' type='continuous'><parent link='" << (i == 0 ? "base" : "link" + std::to_string(i))
         << "'/><child link='link" << number << "'/><origin xyz='" << three(body.joint_at_m)
         << "'/><axis xyz='" << three(body.axis) << "'/></joint>\n";
  }
  text << "<link name='tip'/><joint name='to_tip' type='fixed'><parent link='link" << design.bodies.size()
       << "'/><child link='tip'/><origin xyz='" << three(design.tip_m) << "'/></joint>\n</robot>\n";
  return text.str();
}

HiddenArm::HiddenArm(const ArmDesign& design, std::vector<HiddenEffect> effects)
    : design_(design), effects_(std::move(effects)), skeleton_(dart::dynamics::Skeleton::create()) {
  BodyNode* parent = nullptr;
  for (std::size_t i = 0; i < design.bodies.size(); ++i) {
    const ArmDesign::Body& body = design.bodies[i];
    RevoluteJoint::Properties joint;
    joint.mName = "j" + std::to_string(i);
    joint.mAxis = body.axis;
    joint.mT_ParentBodyToJoint.translation() = body.joint_at_m;
    const auto link = static_cast<int>(i);
    // A wrong mass is spread like the right one.
    const double factor = 1 + size_of("link_mass", link);
    const Eigen::Vector3d centre =
        body.centre_m + size_of("link_centre", link) * Eigen::Vector3d(0.3, 0.2, 0.93);
    dart::dynamics::Inertia inertia(factor * body.mass_kg, centre,
                                    factor * Eigen::Matrix3d(body.inertia_kg_m2.asDiagonal()));
    BodyNode::AspectProperties properties("b" + std::to_string(i), inertia);
    parent = skeleton_->createJointAndBodyNodePair<RevoluteJoint>(parent, joint, properties).second;
  }
  if (const double payload = size_of("payload", -1); payload > 0) {
    dart::dynamics::WeldJoint::Properties joint;
    joint.mName = "grip";
    joint.mT_ParentBodyToJoint.translation() = design.tip_m + Eigen::Vector3d(0.02, 0.01, -0.015);
    const double radius_m = 0.03;
    dart::dynamics::Inertia ball(payload, Eigen::Vector3d::Zero(),
                                 0.4 * payload * radius_m * radius_m * Eigen::Matrix3d::Identity());
    skeleton_->createJointAndBodyNodePair<dart::dynamics::WeldJoint>(
        parent, joint, BodyNode::AspectProperties("payload", ball));
  }
  const double tilt = size_of("gravity_direction", -1);
  skeleton_->setGravity(9.81 * Eigen::Vector3d(std::sin(tilt) * 0.8, -std::sin(tilt) * 0.6, -std::cos(tilt)));
  const Eigen::VectorXd scale = torque_scale_Nm();
  for (Eigen::Index j = 0; j < scale.size(); ++j) friction_.push_back({0.03 * scale[j], 0.01 * scale[j]});
}

double HiddenArm::size_of(std::string_view effect, int part) const {
  for (const HiddenEffect& one : effects_)
    if (one.effect == effect && one.part == part) return one.size;
  return 0;
}

Eigen::VectorXd HiddenArm::torque_scale_Nm() {
  // Held in many poses, and moved by twice as much as it weighs: without any of the hidden effects.
  double weight = 0;
  Eigen::VectorXd scale(static_cast<Eigen::Index>(design_.bodies.size()));
  double reach = design_.tip_m.norm();
  for (std::size_t i = design_.bodies.size(); i-- > 0;) {
    weight += 9.81 * design_.bodies[i].mass_kg * (design_.bodies[i].centre_m.norm() + 0.5 * reach);
    reach += design_.bodies[i].joint_at_m.norm();
    scale[static_cast<Eigen::Index>(i)] = weight;
  }
  return scale;
}

Eigen::VectorXd HiddenArm::rigid_torque_Nm(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                           const Eigen::VectorXd& a) {
  skeleton_->setPositions(q);
  skeleton_->setVelocities(v);
  skeleton_->setAccelerations(a);
  skeleton_->computeInverseDynamics();
  return skeleton_->getForces();
}

Eigen::VectorXd HiddenArm::torque(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                  const Eigen::VectorXd& a, double time_s) {
  const Eigen::VectorXd rigid = rigid_torque_Nm(q, v, a);
  Eigen::VectorXd result = rigid;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const auto joint = static_cast<int>(j);
    const Friction& friction = friction_[static_cast<std::size_t>(j)];
    const double direction = sign_of(v[j]);
    result[j] += direction * (friction.coulomb_Nm + size_of("coulomb", joint) +
                              size_of("load_friction", joint) * std::abs(rigid[j])) +
                 (friction.viscous_Nm_s_per_rad + size_of("viscous", joint)) * v[j] +
                 size_of("torque_offset", joint) + size_of("spring", joint) * (q[j] - 0.3) +
                 size_of("rotor_inertia", joint) * a[j];
    // Outside of what can be named.
    result[j] += size_of("warming_friction", joint) * direction * std::exp(-time_s / 8);
    result[j] += size_of("end_stop", joint) * std::max(0.0, std::abs(q[j]) - 0.5);
    result[j] += size_of("pulse", joint) * (std::fmod(time_s, 3.7) < 1.1 ? 1.0 : 0.0);
  }
  return result;
}

HiddenRecording HiddenArm::record(const RecordingPlan& plan, const std::string& name) {
  const std::vector<Sines> motion = motion_of(design_, plan);
  const auto joints = static_cast<Eigen::Index>(motion.size());
  const auto rows = static_cast<Eigen::Index>(plan.seconds * plan.rate_Hz);
  HiddenRecording recording{name, {}, Eigen::MatrixXd(joints, rows), Eigen::MatrixXd(joints, rows)};
  std::mt19937_64 random(plan.seed + 1000);
  std::normal_distribution<double> normal;
  const Eigen::VectorXd scale = torque_scale_Nm();
  Eigen::VectorXd late;
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = static_cast<double>(i) / plan.rate_Hz;
    Eigen::VectorXd q(joints), v(joints), a(joints);
    for (Eigen::Index j = 0; j < joints; ++j) {
      const Eigen::Vector3d state = motion[static_cast<std::size_t>(j)].at(t);
      q[j] = state[0];
      v[j] = state[1];
      a[j] = state[2];
    }
    const Eigen::VectorXd true_torque = torque(q, v, a, t);
    if (i == 0) late = true_torque;
    late += (true_torque - late) * (1 - std::exp(-1 / (plan.rate_Hz * plan.lag_s)));
    recording.time_s.push_back(t);
    for (Eigen::Index j = 0; j < joints; ++j) {
      const auto joint = static_cast<int>(j);
      double seen = q[j] - size_of("encoder_zero", joint);
      if (const double stiffness = size_of("elasticity", joint); stiffness > 0)
        seen += true_torque[j] / stiffness;  // the encoder is on the motor's side of a spring
      recording.position_rad(j, i) = std::round(seen / kEncoderStep_rad) * kEncoderStep_rad;
      const double factor = 1 + size_of("torque_constant", joint);
      const double reported = late[j] / factor + plan.noise * scale[j] * normal(random);
      const double step = scale[j] / kTorqueSteps;
      recording.torque_Nm(j, i) = std::round(reported / step) * step;
    }
  }
  return recording;
}

}  // namespace robot_gap_test
