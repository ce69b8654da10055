#include "analysis/export_arm.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "analysis/export_arm_parts.h"
#include "analysis/mjcf.h"

namespace analysis {
namespace {

using control::ArmDescription;
using control::ArmDrive;
using control::ArmLink;
using mjcf::escaped;
using mjcf::number;
using mjcf::numbers;

/// Of the free vibration that an elastic gear and its rotor would have: dies out within some periods.
constexpr double kShaftDampingRatio = 0.05;
/// A rotor's body: its inertia is the armature of the joint.
constexpr double kRotorBody_kg_m2 = 1e-12;
constexpr double kRotorBody_kg = 1e-9;
/// Of the moments of a point mass, which some readers of URDF refuse to be zero.
constexpr double kPoint_kg_m2 = 1e-9;
/// Where URDF demands a range and none is known.
constexpr control::JointLimits kNoLimits{-1e3, 1e3, 1e3, 1e3};

/// Names that are taken by links or joints.
class UnusedNames {
 public:
  void take(const std::string& name) { taken_.insert(name); }
  std::string like(std::string name) {
    while (!taken_.insert(name).second) name += '_';
    return name;
  }

 private:
  std::set<std::string> taken_;
};

UnusedNames taken_by(const ArmDescription& arm, const ArmNames& names) {
  UnusedNames unused;
  unused.take(names.base);
  unused.take(names.tip);
  for (const ArmLink& link : arm.arm.links) {
    unused.take(link.link);
    unused.take(link.joint);
  }
  return unused;
}

std::string robot_name(const ArmNames& names) { return escaped(names.robot.empty() ? "robot" : names.robot); }

std::string mjcf_pose(const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  return fmt::format(R"(pos="{}" quat="{}")", numbers(X.translation()),
                     numbers(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z())));
}

SlidingFit sliding_of(const ArmDrive& drive) {
  SlidingFit sliding;
  sliding.coulomb_Nm = drive.coulomb_Nm;
  sliding.viscous_Nm_s_per_rad = drive.viscous_Nm_s_per_rad;
  sliding.quadratic_Nm_s2_per_rad2 = drive.quadratic_drag_Nm_s2_per_rad2;
  if (drive.stribeck_Nm > 0)
    sliding.bristles.push_back({0, drive.stribeck_Nm, drive.stribeck_speed_rad_per_s});
  return sliding;
}

bool has_cable(const ArmDrive& drive) {
  return drive.cable_2_Nm_per_rad2 != 0 || drive.cable_3_Nm_per_rad3 != 0;
}

/// Of the hinge that the link turns with: its range and springs.
std::string link_attributes(const ArmLink& link, const ArmDrive& drive) {
  std::string text;
  if (link.limits)
    text += fmt::format(R"( limited="true" range="{} {}")", number(link.limits->lower),
                        number(link.limits->upper));
  if (has_cable(drive))
    text += fmt::format(R"( stiffness="{} {} {}")", number(drive.spring_Nm_per_rad),
                        number(drive.cable_2_Nm_per_rad2), number(drive.cable_3_Nm_per_rad3));
  else if (drive.spring_Nm_per_rad != 0)
    text += fmt::format(R"( stiffness="{}" springref="{}")", number(drive.spring_Nm_per_rad),
                        number(drive.spring_rest_rad));
  return text;
}

std::string friction_attributes(const ArmDrive& drive, double timestep_s) {
  return mjcf::damping(1, sliding_of(drive)) + mjcf::friction_loss(drive.coulomb_Nm, timestep_s);
}

std::string friction_actuators(const std::string& joint, const ArmDrive& drive, double lightest_kg_m2,
                               double timestep_s) {
  return mjcf::bristles(joint, 1, sliding_of(drive).bristles, mjcf::step_contact(lightest_kg_m2, timestep_s));
}

std::string position_actuators(const std::string& joint, const ArmDrive& drive) {
  std::string text;
  for (const ArmDrive::Ripple& one : drive.ripples)
    text += mjcf::ripple(joint, -std::hypot(one.sine_Nm, one.cosine_Nm), one.periods_per_rev,
                         std::atan2(one.cosine_Nm, one.sine_Nm));
  // The polynomial of a cable is about zero, not about the rest of the spring.
  const double constant_Nm =
      drive.offset_Nm - (has_cable(drive) ? drive.spring_Nm_per_rad * drive.spring_rest_rad : 0);
  if (constant_Nm != 0) text += mjcf::constant(joint, -constant_Nm);
  return text;
}

/// The arm with its nested bodies.
class ArmMjcf {
 public:
  ArmMjcf(const ArmDescription& arm, const ArmNames& names, double timestep_s)
      : arm_(arm),
        names_(names),
        timestep_s_(timestep_s),
        lightest_(lightest_inertias(arm)),
        unused_(taken_by(arm, names)),
        base_(mujoco_base(arm, names)) {
    unused_.take(base_);
  }

  std::string text(std::span<const std::string> remarks) {
    const std::string bodies = this->bodies();
    std::string text = mjcf::head(names_.robot.empty() ? "robot" : names_.robot, timestep_s_, remarks,
                                  arm_.gravity_B_m_per_s2);
    text += "  <compiler angle=\"radian\"/>\n  <worldbody>\n" + bodies + "  </worldbody>\n";
    if (!tendons_.empty()) text += "  <tendon>\n" + tendons_ + "  </tendon>\n";
    return text + "  <actuator>\n" + motors_ + passive_ + "  </actuator>\n</mujoco>\n";
  }

 private:
  std::string bodies() {
    std::string text = fmt::format("    <body name=\"{}\">\n", escaped(base_));
    std::string indent(6, ' ');
    for (std::size_t j = 0; j < arm_.drives.size(); ++j) {
      text += arm_.drives[j].compliance_rad_per_Nm > 0 ? elastic_link(j, indent) : link(j, indent);
      indent += "  ";
    }
    text += fmt::format("{}<site name=\"{}\" {}/>\n", indent, escaped(names_.tip), mjcf_pose(arm_.arm.X_LT));
    if (arm_.payload_kg > 0)
      text += fmt::format(
          "{0}<body name=\"{1}\" pos=\"{2}\">\n{0}  <inertial pos=\"0 0 0\" mass=\"{3}\" diaginertia=\"0 0 "
          "0\"/>\n{0}</body>\n",
          indent, escaped(unused_.like("payload")), numbers(arm_.arm.X_LT * arm_.p_TP_m),
          number(arm_.payload_kg));
    for (; indent.size() > 4; indent.resize(indent.size() - 2)) text += indent.substr(2) + "</body>\n";
    return text;
  }

  /// Opens the body. `joint`: attributes of its joint.
  std::string opened(std::size_t j, const std::string& indent, const std::string& joint) const {
    const ArmLink& link = arm_.arm.links[j];
    const Eigen::Matrix3d& I = link.inertia.about_C_kg_m2;
    Eigen::VectorXd moments(6);
    moments << I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2);
    return fmt::format(
               "{0}<body name=\"{1}\" {2}>\n{0}  <inertial pos=\"{3}\" mass=\"{4}\" fullinertia=\"{5}\"/>\n",
               indent, escaped(link.link), mjcf_pose(link.X_PL), numbers(link.inertia.p_LC_m),
               number(link.inertia.mass_kg), numbers(moments)) +
           hinge(j, indent, joint) + stick(j, indent);
  }
  std::string hinge(std::size_t j, const std::string& indent, const std::string& attributes) const {
    const ArmLink& link = arm_.arm.links[j];
    return fmt::format("{}  <joint type=\"{}\" axis=\"{}\"{}/>\n", indent, link.slides ? "slide" : "hinge",
                       numbers(link.axis_L), attributes);
  }
  /// To the next joint or the tip, to be looked at.
  std::string stick(std::size_t j, const std::string& indent) const {
    constexpr double kShort_m = 1e-3;
    const Eigen::Vector3d to = j + 1 < arm_.arm.links.size() ? arm_.arm.links[j + 1].X_PL.translation()
                                                             : arm_.arm.X_LT.translation();
    if (to.norm() < kShort_m) return {};
    return fmt::format(
        "{}  <geom type=\"capsule\" fromto=\"0 0 0 {}\" size=\"{}\" mass=\"0\" contype=\"0\" "
        "conaffinity=\"0\"/>\n",
        indent, numbers(to), number(0.05 * to.norm()));
  }

  std::string link(std::size_t j, const std::string& indent) {
    const ArmDrive& drive = arm_.drives[j];
    const std::string name = escaped(drive.joint);
    add_motor(name, drive);
    passive_ += friction_actuators(name, drive, lightest_[j], timestep_s_) + position_actuators(name, drive);
    return opened(j, indent,
                  fmt::format(R"( name="{}" armature="{}")", name, number(drive.rotor_inertia_kg_m2)) +
                      link_attributes(arm_.arm.links[j], drive) + friction_attributes(drive, timestep_s_));
  }

  /// The rotor's body stands beside the link's, and a spring couples them.
  std::string elastic_link(std::size_t j, const std::string& indent) {
    const ArmDrive& drive = arm_.drives[j];
    const std::string name = escaped(drive.joint);
    const std::string behind = escaped(unused_.like(drive.joint + "_link"));
    const ElasticShaft shaft = elastic_shaft(drive, lightest_[j], timestep_s_);
    add_motor(name, drive);
    tendons_ +=
        mjcf::shaft(escaped(unused_.like(drive.joint + "_shaft")), name, behind,
                    fmt::format(R"( stiffness="{}" damping="{}" springlength="0 0")",
                                number(shaft.stiffness_Nm_per_rad), number(shaft.damping_Nm_s_per_rad)));
    const bool on_rotor = drive.friction_before_gear;
    const std::string friction = friction_attributes(drive, timestep_s_);
    passive_ += friction_actuators(on_rotor ? name : behind, drive,
                                   on_rotor ? shaft.rotor_kg_m2 : lightest_[j], timestep_s_) +
                position_actuators(behind, drive);
    const std::string rotor =
        fmt::format(
            "{0}<body name=\"{1}\" {2}>\n{0}  <inertial pos=\"0 0 0\" mass=\"{3}\" diaginertia=\"{4} {4} "
            "{4}\"/>\n",
            indent, escaped(unused_.like(drive.joint + "_rotor")), mjcf_pose(arm_.arm.links[j].X_PL),
            number(kRotorBody_kg), number(kRotorBody_kg_m2)) +
        hinge(j, indent,
              fmt::format(R"( name="{}" armature="{}")", name, number(shaft.rotor_kg_m2)) +
                  (on_rotor ? friction : "")) +
        indent + "</body>\n";
    return rotor + opened(j, indent,
                          fmt::format(R"( name="{}")", behind) + link_attributes(arm_.arm.links[j], drive) +
                              (on_rotor ? "" : friction));
  }

  void add_motor(const std::string& joint, const ArmDrive& drive) {
    motors_ += fmt::format("    <motor name=\"{0}\" joint=\"{0}\" gear=\"{1}\"/>\n", joint,
                           number(drive.torque_scale));
  }

  const ArmDescription& arm_;
  const ArmNames& names_;
  double timestep_s_;
  std::vector<double> lightest_;
  UnusedNames unused_;
  std::string base_;
  std::string motors_;
  std::string passive_;
  std::string tendons_;
};

std::string urdf_origin(const Eigen::Isometry3d& X) {
  const Eigen::Vector3d yaw_pitch_roll = X.linear().eulerAngles(2, 1, 0);
  return fmt::format("    <origin xyz=\"{}\" rpy=\"{}\"/>\n", numbers(X.translation()),
                     numbers(yaw_pitch_roll.reverse()));
}

std::string urdf_joint(std::string_view name, std::string_view type, std::string_view parent,
                       std::string_view child, const Eigen::Isometry3d& X, std::string_view more = {}) {
  return fmt::format(
      "  <joint name=\"{}\" type=\"{}\">\n    <parent link=\"{}\"/>\n    <child link=\"{}\"/>\n{}{}  "
      "</joint>\n",
      escaped(name), type, escaped(parent), escaped(child), urdf_origin(X), more);
}

std::string urdf_link(std::string_view name, const control::LinkInertia& body) {
  const Eigen::Matrix3d& I = body.about_C_kg_m2;
  return fmt::format(
      "  <link name=\"{}\">\n    <inertial>\n      <origin xyz=\"{}\"/>\n      <mass value=\"{}\"/>\n"
      "      <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/>\n"
      "    </inertial>\n  </link>\n",
      escaped(name), numbers(body.p_LC_m), number(body.mass_kg), number(I(0, 0)), number(I(0, 1)),
      number(I(0, 2)), number(I(1, 1)), number(I(1, 2)), number(I(2, 2)));
}

std::string urdf_empty_link(std::string_view name) {
  return fmt::format("  <link name=\"{}\"/>\n", escaped(name));
}

}  // namespace

ElasticShaft elastic_shaft(const ArmDrive& drive, double lightest_kg_m2, double timestep_s) {
  ElasticShaft shaft{drive.rotor_inertia_kg_m2, 1 / drive.compliance_rad_per_Nm, 0};
  if (!(shaft.rotor_kg_m2 > 0))
    shaft.rotor_kg_m2 = shaft.stiffness_Nm_per_rad / mjcf::step_contact(1, timestep_s).stiffness_Nm_per_rad;
  const double reduced_kg_m2 = 1 / (1 / shaft.rotor_kg_m2 + 1 / lightest_kg_m2);
  shaft.stiffness_Nm_per_rad =
      std::min(shaft.stiffness_Nm_per_rad, mjcf::stiffest_Nm_per_rad(reduced_kg_m2, timestep_s));
  shaft.damping_Nm_s_per_rad = 2 * kShaftDampingRatio * std::sqrt(shaft.stiffness_Nm_per_rad * reduced_kg_m2);
  return shaft;
}

std::string mujoco_base(const ArmDescription& arm, const ArmNames& names) {
  return names.base == "world" ? taken_by(arm, names).like(names.base) : names.base;
}

std::string arm_mujoco_text(const ArmDescription& arm, const ArmNames& names, double timestep_s,
                            std::span<const std::string> remarks) {
  return ArmMjcf(arm, names, timestep_s).text(remarks);
}

std::string arm_urdf_text(const ArmDescription& arm, const ArmNames& names,
                          std::span<const std::string> remarks) {
  UnusedNames unused = taken_by(arm, names);
  std::string text = fmt::format("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n{}", robot_name(names),
                                 mjcf::comments(remarks, "  "));
  if (!is_level(arm.gravity_B_m_per_s2)) {
    const std::string level = unused.like("level");
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.linear() = Eigen::Quaterniond::FromTwoVectors(arm.gravity_B_m_per_s2, -Eigen::Vector3d::UnitZ())
                     .toRotationMatrix();
    text += urdf_empty_link(level) + urdf_joint(unused.like("tilt"), "fixed", level, names.base, X);
  }
  text += urdf_empty_link(names.base);
  std::string parent = names.base;
  for (std::size_t j = 0; j < arm.drives.size(); ++j) {
    const ArmLink& link = arm.arm.links[j];
    const ArmDrive& drive = arm.drives[j];
    std::string more =
        fmt::format("    <axis xyz=\"{}\"/>\n    <dynamics damping=\"{}\" friction=\"{}\"/>\n",
                    numbers(link.axis_L), number(drive.viscous_Nm_s_per_rad), number(drive.coulomb_Nm));
    const control::JointLimits limits = link.limits.value_or(kNoLimits);
    if (link.limits || link.slides)
      more += fmt::format("    <limit lower=\"{}\" upper=\"{}\" effort=\"{}\" velocity=\"{}\"/>\n",
                          number(limits.lower), number(limits.upper), number(limits.effort),
                          number(limits.speed));
    const char* const type = link.slides ? "prismatic" : link.limits ? "revolute" : "continuous";
    text +=
        urdf_joint(link.joint, type, parent, link.link, link.X_PL, more) + urdf_link(link.link, link.inertia);
    parent = link.link;
  }
  // A tip that is a moving link has no joint of its own.
  if (parent != names.tip)
    text += urdf_joint(unused.like("to_" + names.tip), "fixed", parent, names.tip, arm.arm.X_LT) +
            urdf_empty_link(names.tip);
  if (arm.payload_kg > 0) {
    const std::string payload = unused.like("payload");
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.translation() = arm.p_TP_m;
    text += urdf_joint(unused.like("to_" + payload), "fixed", names.tip, payload, X) +
            urdf_link(payload,
                      {arm.payload_kg, Eigen::Vector3d::Zero(), kPoint_kg_m2 * Eigen::Matrix3d::Identity()});
  }
  return text + "</robot>\n";
}

}  // namespace analysis
