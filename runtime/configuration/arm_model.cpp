#include "runtime/configuration/arm_model.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "control/serial_arm.h"
#include "model/gravity.h"
#include "runtime/configuration/base_file.h"
#include "runtime/configuration/robot_file.h"
#include "runtime/configuration/toml_reader.h"

namespace runtime {
namespace {

using control::ArmDescription;
using control::ArmDrive;
using control::ArmLink;
using control::kArmJoints;
using Misfits = std::vector<RobotMisfit>;

// Rounding of URDFs.
constexpr double kSamePlace_m = 1e-4;
constexpr double kSameDirection_rad = 1e-3;
/// All places on Earth are within it.
constexpr double kSameGravity_m_per_s2 = 0.05;
constexpr double kSameInertia_kg_m2 = 1e-9;

// Plausible values: far beyond any youBot.
constexpr double kHeavyLink_kg = 10;
constexpr double kLongLink_m = 0.3;
constexpr double kHeavyPayload_kg = 2;  // as teleoperation.arm.payload_kg
constexpr double kStrongFriction = 10;  // as teleoperation.arm.coulomb_Nm and viscous_Nm_s_per_rad
constexpr double kLargeRotor_kg_m2 = 10;

const control::SerialArm& youbot_arm() {
  static const control::SerialArm arm = control::read_serial_arm(control::youbot_urdf(), "arm_foot", "tip");
  return arm;
}

std::string joint_names(const control::SerialArm& arm) {
  std::string text;
  for (const ArmLink& link : arm.links) (text += text.empty() ? "" : ", ") += link.joint;
  return text;
}

bool has_joints_of_youbot(const control::SerialArm& arm) {
  return std::ranges::equal(arm.links, youbot_arm().links, {}, &ArmLink::joint, &ArmLink::joint);
}

double angle_between(const Eigen::Vector3d& one, const Eigen::Vector3d& other) {
  return std::atan2(one.cross(other).norm(), one.dot(other));
}

/// Where joint 1 is, and where its zero is, makes no difference to the arm itself.
void check_geometry(const control::SerialArm& arm, Misfits& misfits) {
  for (std::size_t i = 0; i < arm.links.size(); ++i) {
    const ArmLink& link = arm.links[i];
    const ArmLink& ours = youbot_arm().links[i];
    const Eigen::AngleAxisd turn(ours.X_PL.linear().transpose() * link.X_PL.linear());
    const bool is_there =
        i == 0 || ((link.X_PL.translation() - ours.X_PL.translation()).norm() < kSamePlace_m &&
                   std::abs(turn.angle()) < kSameDirection_rad);
    if (link.slides || !is_there || angle_between(link.axis_L, ours.axis_L) > kSameDirection_rad)
      misfits.push_back({"", "", "urdf",
                         fmt::format("has {} at another place, zero or axis than the youBot's arm: use "
                                     "control/youbot.urdf, whose angles are 0 where homing ends",
                                     link.joint)});
  }
}

/// In the frame of link 1, whose z points up on a robot on a level floor.
void check_gravity(const ArmDescription& arm, Misfits& misfits) {
  const Eigen::Vector3d& g_B = arm.gravity_B_m_per_s2;
  const Eigen::Vector3d g_L = arm.arm.links.front().X_PL.linear().transpose() * g_B;
  const double tilt_rad = angle_between(g_L, -Eigen::Vector3d::UnitZ());
  if (tilt_rad > kSameDirection_rad)
    misfits.push_back({"", "", "gravity_m_per_s2",
                       fmt::format("is {:.2f} degrees off the axis of {}: the model of the arm has no tilt. "
                                   "Level the robot and measure again",
                                   tilt_rad * 180 / std::numbers::pi, arm.arm.links.front().joint)});
  if (std::abs(g_B.norm() - model::kGravity_m_per_s2) > kSameGravity_m_per_s2)
    misfits.push_back({"", "", "gravity_m_per_s2",
                       fmt::format("is {:.3f} m/s² in all; allowed is {:.3f}, within {:g}", g_B.norm(),
                                   model::kGravity_m_per_s2, kSameGravity_m_per_s2)});
}

/// Only parts of effects: they mean nothing without the numbers below.
bool is_setting(std::string_view key) {
  return key == "gear_ratio" || key == "stribeck_speed_rad_per_s" || key == "spring_rest_rad";
}

void check_drive(const ArmDrive& drive, Misfits& misfits) {
  const auto refuse = [&](std::string_view key, const std::string& complaint) {
    misfits.push_back({"drive", drive.joint, std::string(key), complaint});
  };
  const auto in_range = [&](std::string_view key, double value, double most) {
    if (value > most)
      refuse(key, fmt::format("of {} is {:g}, allowed is 0 to {:g}", drive.joint, value, most));
  };
  const auto has_no_place = [&](std::string_view key) {
    refuse(key,
           fmt::format("of {} has no place in the model of this arm, and half of a model compensates "
                       "worse than none. Remove its cause on the robot and measure again, or take the key "
                       "out of a copy of the file: the arm is then driven without it",
                       drive.joint));
  };
  for (const DriveKey& key : drive_keys()) {
    const double value = drive.*(key.member);
    if (key.member == &ArmDrive::coulomb_Nm || key.member == &ArmDrive::viscous_Nm_s_per_rad)
      in_range(key.key, value, kStrongFriction);
    else if (key.member == &ArmDrive::rotor_inertia_kg_m2)
      in_range(key.key, value, kLargeRotor_kg_m2);
    else if (!is_setting(key.key) && value != ArmDrive{}.*(key.member))
      has_no_place(key.key);
  }
  if (std::ranges::any_of(drive.ripples,
                          [](const ArmDrive::Ripple& one) { return one.sine_Nm != 0 || one.cosine_Nm != 0; }))
    has_no_place("ripple");
}

void check_link(const ArmLink& link, Misfits& misfits) {
  const auto refuse = [&](std::string_view key, const std::string& complaint) {
    misfits.push_back({"link", link.link, std::string(key), complaint});
  };
  const control::LinkInertia& body = link.inertia;
  if (!(body.mass_kg > 0 && body.mass_kg <= kHeavyLink_kg))
    refuse("mass_kg", fmt::format("gives {} {:g} kg, allowed is above 0 to {:g}", link.link, body.mass_kg,
                                  kHeavyLink_kg));
  if (!(body.p_LC_m.norm() <= kLongLink_m))
    refuse("centre_m", fmt::format("places the centre of mass of {} {:g} m from its joint, allowed is {:g}",
                                   link.link, body.p_LC_m.norm(), kLongLink_m));
  const Eigen::Vector3d moments =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(body.about_C_kg_m2).eigenvalues();
  if (!(moments.minCoeff() >= -kSameInertia_kg_m2))
    refuse("inertia_kg_m2", fmt::format("gives {} a moment of inertia of {:g} kg·m² about an axis, which no "
                                        "body has",
                                        link.link, moments.minCoeff()));
}

Misfits misfits_of(const RobotFile& robot) {
  const ArmDescription& arm = robot.arm;
  if (!has_joints_of_youbot(arm.arm))
    return {{"", "", "urdf",
             fmt::format("moves {} between base and tip; the youBot's arm moves {}, in this order",
                         joint_names(arm.arm), joint_names(youbot_arm()))}};
  Misfits misfits;
  check_geometry(arm.arm, misfits);
  check_gravity(arm, misfits);
  for (const ArmDrive& drive : arm.drives) check_drive(drive, misfits);
  for (const ArmLink& link : arm.arm.links) check_link(link, misfits);
  if (arm.payload_kg > kHeavyPayload_kg)
    misfits.push_back({"payload", "", "mass_kg",
                       fmt::format("is {:g}, allowed is 0 to {:g}", arm.payload_kg, kHeavyPayload_kg)});
  if (arm.payload_kg > 0 && !(arm.p_TP_m.norm() <= kLongLink_m))
    misfits.push_back(
        {"payload", "", "centre_m",
         fmt::format("is {:g} m from the tip, allowed is {:g}", arm.p_TP_m.norm(), kLongLink_m)});
  return misfits;
}

control::ModelChanges::LinkChange link_change(const control::LinkInertia& body,
                                              const control::LinkInertia& ours) {
  control::ModelChanges::LinkChange change;
  change.mass_factor = body.mass_kg / ours.mass_kg;
  change.com_shift_m = body.p_LC_m - ours.p_LC_m;
  change.inertia_change_kg_m2 = body.about_C_kg_m2 - change.mass_factor * ours.about_C_kg_m2;
  return change;
}

ArmModel arm_model_of(const ArmDescription& arm) {
  ArmModel model;
  for (std::size_t i = 0; i < arm.drives.size(); ++i) {
    // Link 0 is the base.
    model.changes.links[i + 1] = link_change(arm.arm.links[i].inertia, youbot_arm().links[i].inertia);
    const ArmDrive& drive = arm.drives[i];
    model.friction.coulomb_Nm[i] = drive.coulomb_Nm;
    model.friction.viscous_Nm_s_per_rad[i] = drive.viscous_Nm_s_per_rad;
    if (drive.rotor_inertia_kg_m2 > 0) model.rotor_inertia_kg_m2[i] = drive.rotor_inertia_kg_m2;
  }
  model.changes.payload_kg = arm.payload_kg;
  model.changes.payload_p_T_m = youbot_arm().X_LT.inverse() * (arm.arm.X_LT * arm.p_TP_m);
  return model;
}

std::string numbers_text(const auto& values, const char* format) {
  std::string text;
  for (const double value : values)
    (text += text.empty() ? "" : ", ") += fmt::format(fmt::runtime(format), value);
  return text;
}

}  // namespace

ArmModel read_arm_model(const std::filesystem::path& path) {
  if (describes_base(path))
    throw ConfigError({fmt::format("{}: describes a base, and an arm is expected", path.string())});
  return arm_model_of(read_robot_file(path, misfits_of).arm);
}

std::vector<std::string> arm_model_lines(const ArmModel& model) {
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < youbot_arm().links.size(); ++i) {
    const control::ModelChanges::LinkChange& change = model.changes.links[i + 1];
    const ArmLink& link = youbot_arm().links[i];
    const double mass_kg = link.inertia.mass_kg;
    const Eigen::Vector3d shift_mm = 1000 * change.com_shift_m;
    if (change.mass_factor == 1 && shift_mm.isZero(0) &&
        change.inertia_change_kg_m2.isZero(kSameInertia_kg_m2))
      continue;
    lines.push_back(fmt::format(
        "{}: {:.3f} kg, not {:.3f}; centre of mass moved by {:.1f}, {:.1f}, {:.1f} mm{}", link.link,
        change.mass_factor * mass_kg, mass_kg, shift_mm.x(), shift_mm.y(), shift_mm.z(),
        change.inertia_change_kg_m2.isZero(kSameInertia_kg_m2) ? "" : "; its own rotational inertia"));
  }
  if (model.changes.payload_kg > 0)
    lines.push_back(fmt::format("payload: {:.3f} kg at {} m from the tip", model.changes.payload_kg,
                                numbers_text(model.changes.payload_p_T_m, "{:.4f}")));
  lines.push_back(fmt::format("Coulomb friction of joints 1 to 5: {} N·m",
                              numbers_text(model.friction.coulomb_Nm, "{:.3f}")));
  lines.push_back(fmt::format("viscous friction of joints 1 to 5: {} N·m·s/rad",
                              numbers_text(model.friction.viscous_Nm_s_per_rad, "{:.3f}")));
  for (std::size_t i = 0; i < model.rotor_inertia_kg_m2.size(); ++i)
    lines.push_back(
        model.rotor_inertia_kg_m2[i]
            ? fmt::format("rotor inertia of joint {}: {:.4f} kg·m²", i + 1, *model.rotor_inertia_kg_m2[i])
            : fmt::format("rotor inertia of joint {}: not in the file, the usual one", i + 1));
  return lines;
}

}  // namespace runtime
