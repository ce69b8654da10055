#include "runtime/configuration/arm_model.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <utility>

#include "control/serial_arm.h"
#include "model/gravity.h"

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
constexpr double kShownInertia_kg_m2 = 5e-7;

// A youBot's arm differs less from its description. Beyond that the data did not determine the value.
constexpr double kLeastMassFactor = 0.5;
constexpr double kMaxMassFactor = 2;
constexpr double kMaxCentreShift_m = 0.05;
/// Of the largest moment of inertia. There is no lower limit: little of it acts on a torque.
constexpr double kMaxMomentFactor = 10;
constexpr double kMaxPayloadDistance_m = 0.3;
/// A smaller rotor makes the simulated arm unstable. The limit also refuses an inertia before the gear, which
/// is less than a thousandth of that behind it.
constexpr double kLeastRotorFactor = 0.2;
constexpr double kMaxRotorFactor = 5;

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
                       fmt::format("has a magnitude of {:.3f} m/s²; allowed is {:.3f}, within {:g}",
                                   g_B.norm(), model::kGravity_m_per_s2, kSameGravity_m_per_s2)});
}

/// A key that has no effect unless another key has one, and that key is refused.
bool is_setting(std::string_view key) {
  return key == "gear_ratio" || key == "stribeck_speed_rad_per_s" || key == "spring_rest_rad";
}

/// What removes the cause on the robot; empty: the cause is part of motor or gear.
std::string_view remedy_on_robot(std::string_view key) {
  if (key == "encoder_zero_rad") return "correct the zero of the joint";
  if (key == "spring_Nm_per_rad") return "remove the spring";
  if (key == "cable_2_Nm_per_rad2" || key == "cable_3_Nm_per_rad3")
    return "free the cable that pulls at this joint";
  return "";
}

/// Of the model without a file.
double usual_rotor_kg_m2(std::size_t joint) {
  return control::WholeBodyController::Config{}.rotor_inertia_kg_m2[joint];
}

void check_drive(const ArmDrive& drive, std::size_t joint, Misfits& misfits) {
  const auto refuse = [&](std::string_view key, const std::string& complaint) {
    misfits.push_back({"drive", drive.joint, std::string(key), complaint});
  };
  const auto check_friction = [&](std::string_view key, double value) {
    if (value > kMaxJointFriction)
      refuse(key, fmt::format("of {} is {:g}, allowed is 0 to {:g}", drive.joint, value, kMaxJointFriction));
  };
  const auto check_rotor = [&](std::string_view key, double value_kg_m2) {
    const double usual_kg_m2 = usual_rotor_kg_m2(joint);
    const double least_kg_m2 = kLeastRotorFactor * usual_kg_m2;
    const double most_kg_m2 = kMaxRotorFactor * usual_kg_m2;
    if (!(value_kg_m2 >= least_kg_m2 && value_kg_m2 <= most_kg_m2))
      refuse(key,
             fmt::format("of {} is {}, allowed is {:.3g} to {:.3g} kg·m² behind the gear: the inertia of "
                         "the rotor by the square of the gear ratio",
                         drive.joint, value_kg_m2 == 0 ? "zero or missing" : fmt::format("{:g}", value_kg_m2),
                         least_kg_m2, most_kg_m2));
  };
  const auto refuse_effect = [&](std::string_view key) {
    const std::string_view remedy = remedy_on_robot(key);
    refuse(key, fmt::format("of {} is an effect that control has no model of{}", drive.joint,
                            remedy.empty() ? "; without a robot file, [teleoperation.arm] takes coulomb_Nm, "
                                             "viscous_Nm_s_per_rad and payload_kg"
                                           : fmt::format(": on the robot, {}, and measure again", remedy)));
  };
  for (const DriveKey& key : drive_keys()) {
    const double value = drive.*(key.member);
    if (key.member == &ArmDrive::coulomb_Nm || key.member == &ArmDrive::viscous_Nm_s_per_rad)
      check_friction(key.key, value);
    else if (key.member == &ArmDrive::rotor_inertia_kg_m2)
      check_rotor(key.key, value);
    else if (!is_setting(key.key) && value != ArmDrive{}.*(key.member))
      refuse_effect(key.key);
  }
  if (std::ranges::any_of(drive.ripples,
                          [](const ArmDrive::Ripple& one) { return one.sine_Nm != 0 || one.cosine_Nm != 0; }))
    refuse_effect("ripple");
}

double largest_moment_kg_m2(const control::LinkInertia& body) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(body.about_C_kg_m2).eigenvalues().maxCoeff();
}

/// Columns with youbotd's names hold SI units.
void check_factors(const RobotFile::Columns& columns, std::size_t i, const std::string& joint,
                   Misfits& misfits) {
  const auto check = [&](std::string_view key, double factor, const std::string& column) {
    if (factor != 1 && column.starts_with(fmt::format("arm_{}_", i + 1)))
      misfits.push_back(
          {"drive", joint, std::string(key),
           fmt::format("of {} is {:g}, but {} is a column of youbotd, in rad or N·m: the factor "
                       "would scale all that was identified from it",
                       joint, factor, column)});
  };
  check("position_factor", columns.position_factor[i], columns.position[i]);
  check("torque_factor", columns.torque_factor[i], columns.torque[i]);
}

void check_link(const ArmLink& link, const control::LinkInertia& ours, Misfits& misfits) {
  const auto refuse = [&](std::string_view key, const std::string& complaint) {
    misfits.push_back({"link", link.link, std::string(key), complaint});
  };
  const control::LinkInertia& body = link.inertia;
  const double least_kg = kLeastMassFactor * ours.mass_kg;
  const double most_kg = kMaxMassFactor * ours.mass_kg;
  if (!(body.mass_kg >= least_kg && body.mass_kg <= most_kg))
    refuse("mass_kg",
           fmt::format("gives {} {:g} kg, allowed is {:.3g} to {:.3g}: {:g} to {:g} times its mass "
                       "in control/youbot.urdf",
                       link.link, body.mass_kg, least_kg, most_kg, kLeastMassFactor, kMaxMassFactor));
  const double shift_m = (body.p_LC_m - ours.p_LC_m).norm();
  if (!(shift_m <= kMaxCentreShift_m))
    refuse("centre_m", fmt::format("places the centre of mass of {} {:.3g} m from where control/youbot.urdf "
                                   "has it, allowed is {:g}",
                                   link.link, shift_m, kMaxCentreShift_m));
  const double scale_kg_m2 = std::max(body.about_C_kg_m2.norm(), ours.about_C_kg_m2.norm());
  if (const auto least_kg_m2 = control::negative_moment_kg_m2(body.about_C_kg_m2, scale_kg_m2))
    refuse("inertia_kg_m2", fmt::format("gives {} a moment of inertia of {:g} kg·m² about an axis, which no "
                                        "body has",
                                        link.link, *least_kg_m2));
  const double moment_kg_m2 = largest_moment_kg_m2(body);
  const double most_kg_m2 = kMaxMomentFactor * largest_moment_kg_m2(ours);
  if (!(moment_kg_m2 <= most_kg_m2))
    refuse("inertia_kg_m2", fmt::format("gives {} a moment of inertia of {:g} kg·m², allowed is {:.3g}",
                                        link.link, moment_kg_m2, most_kg_m2));
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
  for (std::size_t i = 0; i < arm.drives.size(); ++i) {
    check_drive(arm.drives[i], i, misfits);
    check_factors(robot.columns, i, arm.drives[i].joint, misfits);
    check_link(arm.arm.links[i], youbot_arm().links[i].inertia, misfits);
  }
  if (arm.payload_kg > kMaxPayload_kg)
    misfits.push_back({"payload", "", "mass_kg",
                       fmt::format("is {:g}, allowed is 0 to {:g}", arm.payload_kg, kMaxPayload_kg)});
  if (arm.payload_kg > 0 && !(arm.p_TP_m.norm() <= kMaxPayloadDistance_m))
    misfits.push_back(
        {"payload", "", "centre_m",
         fmt::format("is {:g} m from the tip, allowed is {:g}", arm.p_TP_m.norm(), kMaxPayloadDistance_m)});
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

std::vector<std::string> scaled_columns(const RobotFile::Columns& columns) {
  std::vector<std::string> lines;
  const auto add = [&](std::string_view key, double factor, const std::string& column) {
    if (factor != 1)
      lines.push_back(fmt::format("identified from recordings whose {} was multiplied by {} = {:g}", column,
                                  key, factor));
  };
  for (std::size_t i = 0; i < columns.position.size(); ++i) {
    add("position_factor", columns.position_factor[i], columns.position[i]);
    add("torque_factor", columns.torque_factor[i], columns.torque[i]);
  }
  return lines;
}

ArmModel arm_model_of(const RobotFile& robot) {
  const ArmDescription& arm = robot.arm;
  ArmModel model;
  for (std::size_t i = 0; i < arm.drives.size(); ++i) {
    // Link 0 is the base.
    model.changes.links[i + 1] = link_change(arm.arm.links[i].inertia, youbot_arm().links[i].inertia);
    const ArmDrive& drive = arm.drives[i];
    model.friction.coulomb_Nm[i] = drive.coulomb_Nm;
    model.friction.viscous_Nm_s_per_rad[i] = drive.viscous_Nm_s_per_rad;
    model.rotor_inertia_kg_m2[i] = drive.rotor_inertia_kg_m2;
  }
  model.changes.payload_kg = arm.payload_kg;
  model.changes.payload_p_T_m = youbot_arm().X_LT.inverse() * (arm.arm.X_LT * arm.p_TP_m);
  model.scaled_columns = scaled_columns(robot.columns);
  return model;
}

std::string numbers_text(const auto& values, const char* format) {
  std::string text;
  for (const double value : values)
    (text += text.empty() ? "" : ", ") += fmt::format(fmt::runtime(format), value);
  return text;
}

std::string tensor_text(const Eigen::Matrix3d& I) {
  return numbers_text(std::array{I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)}, "{:.6f}");
}

/// Empty if nothing differs.
std::string link_text(const ArmLink& link, const control::ModelChanges::LinkChange& change) {
  std::vector<std::string> parts;
  const auto add = [&](const char* what, const std::string& before, const std::string& after,
                       const char* unit) {
    if (after != before) parts.push_back(fmt::format("{} {} -> {} {}", what, before, after, unit));
  };
  const control::LinkInertia& ours = link.inertia;
  add("mass", fmt::format("{:g}", ours.mass_kg), fmt::format("{:g}", change.mass_factor * ours.mass_kg),
      "kg");
  add("centre of mass", numbers_text(ours.p_LC_m, "{:.4f}"),
      numbers_text(Eigen::Vector3d(ours.p_LC_m + change.com_shift_m), "{:.4f}"), "m");
  const Eigen::Matrix3d after = change.mass_factor * ours.about_C_kg_m2 + change.inertia_change_kg_m2;
  if (!(after - ours.about_C_kg_m2).isZero(kShownInertia_kg_m2))
    parts.push_back(fmt::format("rotational inertia xx, xy, xz, yy, yz, zz {} -> {} kg·m²",
                                tensor_text(ours.about_C_kg_m2), tensor_text(after)));
  return fmt::format("{}", fmt::join(parts, "; "));
}

}  // namespace

ArmModelFile read_arm_model(const std::filesystem::path& path) {
  RobotFile robot = read_robot_file(path, misfits_of);
  ArmModel model = arm_model_of(robot);
  return {std::move(robot), std::move(model)};
}

std::vector<std::string> arm_model_lines(const ArmModel& model) {
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < youbot_arm().links.size(); ++i) {
    const ArmLink& link = youbot_arm().links[i];
    if (const std::string text = link_text(link, model.changes.links[i + 1]); !text.empty())
      lines.push_back(link.link + ": " + text);
  }
  if (model.changes.payload_kg > 0)
    lines.push_back(fmt::format("payload: {:.3f} kg at {} m from the tip", model.changes.payload_kg,
                                numbers_text(model.changes.payload_p_T_m, "{:.4f}")));
  lines.push_back(fmt::format("Coulomb friction of joints 1 to 5: {} N·m",
                              numbers_text(model.friction.coulomb_Nm, "{:.3f}")));
  lines.push_back(fmt::format("viscous friction of joints 1 to 5: {} N·m·s/rad",
                              numbers_text(model.friction.viscous_Nm_s_per_rad, "{:.3f}")));
  lines.push_back(fmt::format("rotor inertia of joints 1 to 5: {} kg·m²",
                              numbers_text(model.rotor_inertia_kg_m2, "{:.4f}")));
  lines.insert(lines.end(), model.scaled_columns.begin(), model.scaled_columns.end());
  return lines;
}

}  // namespace runtime
