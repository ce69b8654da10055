#include "control/robot_model.h"

#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <kdl/frames.hpp>
#include <kdl/rigidbodyinertia.hpp>
#include <kdl/segment.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "control/serial_arm.h"
#include "control/youbot_urdf.h"
#include "model/gravity.h"

namespace control {
namespace {

constexpr std::size_t kAxes = kChainAxes;
constexpr std::size_t kYaw = kBaseAxes - 1;  // the axis that rotates the base itself
constexpr std::array<const char*, kLinks> kLinkNames = {"the base",   "arm link 1", "arm link 2",
                                                        "arm link 3", "arm link 4", "arm link 5"};

constexpr std::size_t axis_of(std::size_t link) { return kYaw + link; }

std::invalid_argument bad_description(const std::string& what) {
  return std::invalid_argument("robot description: " + what);
}
std::invalid_argument bad_change(const std::string& what, double value) {
  return std::invalid_argument("robot model: " + what + ", not " + std::to_string(value));
}

KDL::Vector to_kdl(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }
KDL::Vector to_kdl(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
KDL::Frame to_kdl(const urdf::Pose& X) {
  return {KDL::Rotation::Quaternion(X.rotation.x, X.rotation.y, X.rotation.z, X.rotation.w),
          to_kdl(X.position)};
}
Eigen::Vector3d to_eigen(const KDL::Vector& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Isometry3d to_eigen(const KDL::Frame& frame) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(frame.M.data);
  X.translation() = to_eigen(frame.p);
  return X;
}

bool moves(const urdf::Joint& joint) { return joint.type != urdf::Joint::FIXED; }

/// Inertia of a link and everything fixed to it, in the link's frame.
KDL::RigidBodyInertia rigid_inertia(const urdf::ModelInterface& robot, const urdf::Link& link) {
  auto sum = KDL::RigidBodyInertia::Zero();
  if (link.inertial) {
    const urdf::Inertial& i = *link.inertial;
    const KDL::RotationalInertia tensor(i.ixx, i.iyy, i.izz, i.ixy, i.ixz, i.iyz);
    sum = to_kdl(i.origin) * KDL::RigidBodyInertia(i.mass, KDL::Vector::Zero(), tensor);
  }
  for (const auto& joint : link.child_joints)
    if (!moves(*joint))
      sum = sum + to_kdl(joint->parent_to_joint_origin_transform) *
                      rigid_inertia(robot, *robot.getLink(joint->child_link_name));
  return sum;
}

/// From the root to T. Every moving joint must be on this path.
std::vector<urdf::JointConstSharedPtr> path_to_tip(const urdf::ModelInterface& robot) {
  std::vector<urdf::JointConstSharedPtr> path;
  urdf::LinkConstSharedPtr link = robot.getLink("tip");
  if (!link) throw bad_description("there is no link called tip");
  for (; link->parent_joint; link = link->getParent()) path.push_back(link->parent_joint);
  std::reverse(path.begin(), path.end());

  const auto on_path =
      std::count_if(path.begin(), path.end(), [](const auto& joint) { return moves(*joint); });
  const auto of_all = std::count_if(robot.joints_.begin(), robot.joints_.end(),
                                    [](const auto& named) { return moves(*named.second); });
  if (on_path != kChainAxes || of_all != kChainAxes)
    throw bad_description("8 joints should move, those of base and arm on the way to tip; " +
                          std::to_string(of_all) + " do, and " + std::to_string(on_path) + " of them there");
  return path;
}

/// The base slides along x and y and turns about z; the joints of the arm turn.
void check_axis(std::size_t axis, const urdf::Joint& joint) {
  const bool slides = joint.type == urdf::Joint::PRISMATIC;
  const bool turns = joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS;
  if (axis < kYaw ? !slides : !turns)
    throw bad_description("joint " + joint.name + " should " + (axis < kYaw ? "slide" : "turn"));
  const std::array<double, 3> along = {joint.axis.x, joint.axis.y, joint.axis.z};
  if (axis <= kYaw && along[axis] != 1.0)
    throw bad_description("joint " + joint.name + " should be along " + "xyz"[axis]);
}

JointRange range_of(const urdf::Joint& joint) {
  if (!joint.limits || !(joint.limits->lower < joint.limits->upper))
    throw bad_description("joint " + joint.name + " has no lower limit below an upper one");
  return {joint.limits->lower, joint.limits->upper};
}

KDL::RigidBodyInertia changed(const KDL::RigidBodyInertia& inertia, const ModelChanges::LinkChange& change,
                              const std::string& name) {
  if (!std::isfinite(change.mass_factor) || change.mass_factor <= 0)
    throw bad_change("mass_factor of " + name + " must be finite and positive", change.mass_factor);
  for (const double shift_m : change.com_shift_m)
    if (!std::isfinite(shift_m)) throw bad_change("com_shift_m of " + name + " must be finite", shift_m);
  const KDL::Vector com = inertia.getCOG();
  KDL::RotationalInertia about_com = (KDL::Frame(-com) * inertia).getRotationalInertia();
  Eigen::Map<Eigen::Matrix3d> tensor(about_com.data);
  tensor *= change.mass_factor;
  const double scale_kg_m2 = tensor.norm() + change.inertia_change_kg_m2.norm();
  tensor += change.inertia_change_kg_m2;
  if (const auto least_kg_m2 = negative_moment_kg_m2(tensor, scale_kg_m2))
    throw bad_change("no moment of inertia of " + name + " may be negative", *least_kg_m2);
  return KDL::RigidBodyInertia(change.mass_factor * inertia.getMass(), com + to_kdl(change.com_shift_m),
                               about_com);
}

}  // namespace

std::string_view youbot_urdf() noexcept { return kYoubotUrdf; }

/// Values of the cycle, and its twists, inertias and wrenches, refer to the origin of W and are in W, so that
/// they can be added directly.
struct RobotModel::Chain {
  std::array<KDL::Segment, kAxes> segments;
  std::array<KDL::RigidBodyInertia, kAxes> inertias;  // of the parts that an axis moves, in its link's frame
  KDL::Frame X_tip;                                   // T in the frame of the last link
  std::array<JointRange, kArmJoints> ranges;
  double total_mass_kg = 0.0;

  std::array<Eigen::Isometry3d, kLinks> X_WL;
  Eigen::Isometry3d X_WT;
  Jacobian J_WT;
  std::array<KDL::Frame, kAxes> X_W;            // of the links' frames
  std::array<KDL::Twist, kAxes> unit_twists_W;  // by an axis that moves at 1 m/s or 1 rad/s
  bool inertias_known = false;                  // at this q: the next two
  std::array<KDL::RigidBodyInertia, kAxes> inertias_W;
  std::array<KDL::RigidBodyInertia, kAxes> outboard_W;  // of an axis' link and all after it

  explicit Chain(const urdf::ModelInterface& robot) {
    std::size_t axis = 0;
    for (const auto& joint : path_to_tip(robot)) {
      X_tip = X_tip * to_kdl(joint->parent_to_joint_origin_transform);
      if (!moves(*joint)) continue;
      check_axis(axis, *joint);
      if (axis > kYaw) ranges[axis - kBaseAxes] = range_of(*joint);
      segments[axis] = KDL::Segment(KDL::Joint(joint->name, X_tip.p, X_tip.M * to_kdl(joint->axis),
                                               axis < kYaw ? KDL::Joint::TransAxis : KDL::Joint::RotAxis),
                                    X_tip);
      inertias[axis] = rigid_inertia(robot, *robot.getLink(joint->child_link_name));
      const double mass_kg = inertias[axis].getMass();
      if (axis >= kYaw && !(mass_kg > 0))
        throw bad_description("what joint " + joint->name + " moves should weigh something, not " +
                              std::to_string(mass_kg) + " kg");
      X_tip = KDL::Frame::Identity();
      ++axis;
    }
  }

  /// Not called where only kinematics are needed.
  void require_inertias() noexcept {
    if (inertias_known) return;
    for (std::size_t i = 0; i < kAxes; ++i) inertias_W[i] = X_W[i] * inertias[i];
    outboard_W.back() = inertias_W.back();
    for (std::size_t i = kAxes - 1; i-- > 0;) outboard_W[i] = inertias_W[i] + outboard_W[i + 1];
    inertias_known = true;
  }

  void change(const ModelChanges& changes) {
    for (std::size_t link = 0; link < kLinks; ++link)
      inertias[axis_of(link)] = changed(inertias[axis_of(link)], changes.links[link], kLinkNames[link]);
    if (!std::isfinite(changes.payload_kg) || changes.payload_kg < 0)
      throw bad_change("payload_kg must be finite and not negative", changes.payload_kg);
    if (!changes.payload_p_T_m.allFinite())
      throw bad_change("payload_p_T_m must be finite", changes.payload_p_T_m.norm());
    inertias.back() =
        inertias.back() + KDL::RigidBodyInertia(changes.payload_kg, X_tip * to_kdl(changes.payload_p_T_m));
    for (const KDL::RigidBodyInertia& inertia : inertias) total_mass_kg += inertia.getMass();
  }
};

RobotModel::RobotModel(const ModelChanges& changes, std::string_view urdf) {
  const auto robot = urdf::parseURDF(std::string(urdf));
  if (!robot) throw bad_description("not a URDF that can be read; the reason is on the console");
  chain_ = std::make_unique<Chain>(*robot);
  chain_->change(changes);
  update(ChainVector::Zero());
}
RobotModel::RobotModel(RobotModel&&) noexcept = default;
RobotModel& RobotModel::operator=(RobotModel&&) noexcept = default;
RobotModel::~RobotModel() = default;

const std::array<JointRange, kArmJoints>& RobotModel::ranges() const noexcept { return chain_->ranges; }
double RobotModel::total_mass_kg() const noexcept { return chain_->total_mass_kg; }

void RobotModel::update(const ChainVector& q) noexcept {
  Chain& c = *chain_;
  KDL::Frame X;
  for (std::size_t i = 0; i < kAxes; ++i) {
    const KDL::Rotation R_parent = X.M;
    X = X * c.segments[i].pose(q[static_cast<int>(i)]);
    // The frame's origin is on the axis: it translates with a prismatic joint and is fixed in a revolute one.
    c.unit_twists_W[i] = (R_parent * c.segments[i].getJoint().twist(1.0)).RefPoint(-X.p);
    c.X_W[i] = X;
    if (i >= kYaw) c.X_WL[i - kYaw] = to_eigen(X);
  }
  c.X_WT = to_eigen(X * c.X_tip);
  c.J_WT.topRows<3>() = point_jacobian(Link::kArm5, c.X_WT.translation());
  for (std::size_t i = 0; i < kAxes; ++i)
    c.J_WT.col(static_cast<int>(i)).tail<3>() = to_eigen(c.unit_twists_W[i].rot);
  c.inertias_known = false;
}

const Eigen::Isometry3d& RobotModel::X_WT() const noexcept { return chain_->X_WT; }
const Jacobian& RobotModel::J_WT() const noexcept { return chain_->J_WT; }
const Eigen::Isometry3d& RobotModel::X_WL(Link link) const noexcept {
  return chain_->X_WL[static_cast<std::size_t>(link)];
}

PointJacobian RobotModel::point_jacobian(Link link, const Eigen::Vector3d& p_W) const noexcept {
  PointJacobian J = PointJacobian::Zero();
  for (std::size_t i = 0; i <= axis_of(static_cast<std::size_t>(link)); ++i)
    J.col(static_cast<int>(i)) = to_eigen(chain_->unit_twists_W[i].RefPoint(to_kdl(p_W)).vel);
  return J;
}

// Composite rigid body algorithm: an axis moves all links after it as one rigid body.
ChainMatrix RobotModel::mass() noexcept {
  chain_->require_inertias();
  ChainMatrix M;
  for (std::size_t i = 0; i < kAxes; ++i) {
    const KDL::Wrench momentum = chain_->outboard_W[i] * chain_->unit_twists_W[i];
    for (std::size_t j = 0; j <= i; ++j)
      M(static_cast<int>(i), static_cast<int>(j)) = M(static_cast<int>(j), static_cast<int>(i)) =
          dot(chain_->unit_twists_W[j], momentum);
  }
  return M;
}

// Gravity acts like an upward acceleration.
ChainVector RobotModel::gravity_Nm() noexcept {
  chain_->require_inertias();
  const KDL::Twist upwards(KDL::Vector(0, 0, model::kGravity_m_per_s2), KDL::Vector::Zero());
  ChainVector g;
  for (std::size_t i = 0; i < kAxes; ++i)
    g[static_cast<int>(i)] = dot(chain_->unit_twists_W[i], chain_->outboard_W[i] * upwards);
  return g;
}

// Recursive Newton-Euler, with zero joint accelerations.
ChainVector RobotModel::coriolis_Nm(const ChainVector& velocity) noexcept {
  chain_->require_inertias();
  std::array<KDL::Wrench, kAxes> wrenches;
  auto v = KDL::Twist::Zero(), a = KDL::Twist::Zero();
  for (std::size_t i = 0; i < kAxes; ++i) {
    const KDL::Twist relative = chain_->unit_twists_W[i] * velocity[static_cast<int>(i)];
    a += v * relative;  // acceleration of the axis itself, moved by those before it
    v += relative;
    wrenches[i] = chain_->inertias_W[i] * a + v * (chain_->inertias_W[i] * v);
  }
  ChainVector c;
  auto outboard = KDL::Wrench::Zero();
  for (std::size_t i = kAxes; i-- > 0;) {
    outboard += wrenches[i];
    c[static_cast<int>(i)] = dot(chain_->unit_twists_W[i], outboard);
  }
  return c;
}

}  // namespace control
