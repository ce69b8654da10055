#include "control/serial_arm.h"

#include <urdf_parser/urdf_parser.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <set>
#include <stdexcept>
#include <string>

namespace control {
namespace {

/// Relative rounding of the numbers in URDFs and robot files.
constexpr double kRounding = 1e-6;

Eigen::Vector3d vector_of(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }
Eigen::Isometry3d isometry_of(const urdf::Pose& pose) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::Quaterniond(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z)
                   .normalized()
                   .toRotationMatrix();
  X.translation() = vector_of(pose.position);
  return X;
}

Eigen::Matrix3d about_origin(const LinkInertia& body) {
  const Eigen::Vector3d& c = body.p_LC_m;
  return body.about_C_kg_m2 +
         body.mass_kg * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose());
}

LinkInertia sum_of(const LinkInertia& a, const LinkInertia& b) {
  LinkInertia sum;
  sum.mass_kg = a.mass_kg + b.mass_kg;
  if (!(sum.mass_kg > 0)) {
    sum.about_C_kg_m2 = a.about_C_kg_m2 + b.about_C_kg_m2;
    return sum;
  }
  sum.p_LC_m = (a.mass_kg * a.p_LC_m + b.mass_kg * b.p_LC_m) / sum.mass_kg;
  LinkInertia point{sum.mass_kg, sum.p_LC_m, Eigen::Matrix3d::Zero()};
  sum.about_C_kg_m2 = about_origin(a) + about_origin(b) - about_origin(point);
  return sum;
}

/// In the frame in which the body's frame is at X.
LinkInertia seen_from(const Eigen::Isometry3d& X, const LinkInertia& body) {
  return {body.mass_kg, X * body.p_LC_m, X.linear() * body.about_C_kg_m2 * X.linear().transpose()};
}

/// Of a link and everything after it but the chain's next link, in the link's frame.
LinkInertia fixed_inertia(const urdf::ModelInterface& robot, const urdf::Link& link,
                          const urdf::Joint* next) {
  LinkInertia sum;
  if (link.inertial) {
    const urdf::Inertial& i = *link.inertial;
    LinkInertia own;
    own.mass_kg = i.mass;
    own.about_C_kg_m2 << i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz;
    sum = seen_from(isometry_of(i.origin), own);
  }
  for (const auto& joint : link.child_joints)
    if (joint.get() != next)
      sum = sum_of(sum, seen_from(isometry_of(joint->parent_to_joint_origin_transform),
                                  fixed_inertia(robot, *robot.getLink(joint->child_link_name), next)));
  return sum;
}

std::invalid_argument bad_arm(const std::string& what) { return std::invalid_argument("URDF: " + what); }

std::string names_of(const std::map<std::string, urdf::LinkSharedPtr>& links) {
  std::string text;
  for (const auto& [name, link] : links) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// urdfdom reads a URDF whose links form a ring beside its tree. Such links own each other: the ring is cut.
void require_tree(urdf::ModelInterface& robot) {
  for (const auto& [name, link] : robot.links_) {
    std::size_t steps = 0;
    for (auto at = link; at->getParent(); at = at->getParent())
      if (++steps > robot.links_.size()) {
        for (const auto& [other, owner] : robot.links_) owner->child_links.clear();
        throw bad_arm("link " + name + " is below itself: its joints form a ring");
      }
  }
  std::set<std::string> children;
  for (const auto& [name, joint] : robot.joints_)
    if (!children.insert(joint->child_link_name).second)
      throw bad_arm("link " + joint->child_link_name + " is the child of two joints");
}

ArmLink moved_link(const urdf::ModelInterface& robot, const urdf::Joint& joint, const urdf::Joint* next) {
  using urdf::Joint;
  if (joint.type != Joint::REVOLUTE && joint.type != Joint::CONTINUOUS && joint.type != Joint::PRISMATIC)
    throw bad_arm("joint " + joint.name + " must be revolute, continuous or prismatic");
  ArmLink result;
  result.joint = joint.name;
  result.link = joint.child_link_name;
  result.slides = joint.type == Joint::PRISMATIC;
  const Eigen::Vector3d axis = vector_of(joint.axis);
  if (!(axis.norm() > 0)) throw bad_arm("joint " + joint.name + " has no axis");
  result.axis_L = axis.normalized();
  if (joint.type != Joint::CONTINUOUS && joint.limits && joint.limits->lower < joint.limits->upper &&
      std::isfinite(joint.limits->lower) && std::isfinite(joint.limits->upper))
    result.limits = {joint.limits->lower, joint.limits->upper, joint.limits->effort, joint.limits->velocity};
  result.inertia = fixed_inertia(robot, *robot.getLink(joint.child_link_name), next);
  if (!result.inertia.p_LC_m.allFinite() || !result.inertia.about_C_kg_m2.allFinite() ||
      result.inertia.mass_kg < 0)
    throw bad_arm("link " + result.link + " needs a finite inertia and a mass that is not negative");
  const Eigen::Matrix3d& inertia = result.inertia.about_C_kg_m2;
  if (negative_moment_kg_m2(inertia, inertia.norm()))
    throw bad_arm("link " + result.link +
                  " has a negative moment of inertia about an axis, which no body has: check ixx to izz");
  return result;
}

}  // namespace

std::optional<double> negative_moment_kg_m2(const Eigen::Matrix3d& tensor_kg_m2, double scale_kg_m2) {
  const double least_kg_m2 =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(tensor_kg_m2).eigenvalues().minCoeff();
  if (least_kg_m2 >= -kRounding * scale_kg_m2) return std::nullopt;
  return least_kg_m2;
}

SerialArm read_serial_arm(std::string_view urdf, const std::string& base, const std::string& tip) {
  const auto robot = urdf::parseURDF(std::string(urdf));
  if (!robot) throw bad_arm("it cannot be read; the reason is on the console");
  require_tree(*robot);
  for (const std::string& name : {base, tip})
    if (!robot->getLink(name))
      throw bad_arm("there is no link called " + name + "; its links: " + names_of(robot->links_));
  std::vector<urdf::JointConstSharedPtr> path;
  urdf::LinkConstSharedPtr at = robot->getLink(tip);
  for (; at && at->name != base; at = at->getParent()) {
    if (!at->parent_joint)
      throw bad_arm("link " + tip + " is not below link " + base + ": 'base' is the end that stands still");
    path.push_back(at->parent_joint);
  }
  std::ranges::reverse(path);

  SerialArm arm;
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();  // of the next joint, in the last link that moves
  for (std::size_t i = 0; i < path.size(); ++i) {
    const urdf::Joint& joint = *path[i];
    X = X * isometry_of(joint.parent_to_joint_origin_transform);
    if (joint.type == urdf::Joint::FIXED) continue;
    const auto next = std::find_if(path.begin() + static_cast<std::ptrdiff_t>(i) + 1, path.end(),
                                   [](const auto& one) { return one->type != urdf::Joint::FIXED; });
    arm.links.push_back(moved_link(*robot, joint, next == path.end() ? nullptr : next->get()));
    arm.links.back().X_PL = X;
    X = Eigen::Isometry3d::Identity();
  }
  if (arm.links.empty()) throw bad_arm("no joint moves between " + base + " and " + tip);
  if (!X.matrix().allFinite()) throw bad_arm("a frame is not finite");
  arm.X_LT = X;
  return arm;
}

}  // namespace control
