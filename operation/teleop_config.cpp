#include "operation/teleop_config.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "control/robot_model.h"
#include "runtime/configuration/arm_model.h"

namespace operation {
namespace {

using control::Teleoperation;
using runtime::TomlTable;

constexpr double kDegree = std::numbers::pi / 180;
/// Of a joint's torque limit that weight may take. The rest moves the arm.
constexpr double kMaxWeightShare = 0.9;

/// In degrees in the file, in radians here.
void read_degrees(TomlTable& table, std::string_view key, double& value_rad, double min, double max) {
  double value = value_rad / kDegree;
  table.number(key, value, {.min = min, .max = max});
  value_rad = value * kDegree;
}

void read_stiffness(TomlTable& table, const std::string& prefix, control::CartesianStiffness& stiffness) {
  table.number(prefix + "_N_per_m", stiffness.translation_N_per_m, {.min = 1, .max = 5000});
  table.number(prefix + "_Nm_per_rad", stiffness.rotation_Nm_per_rad, {.min = 0.1, .max = 200});
}

/// Angles of the arm within the ranges of its joints.
void read_posture(TomlTable& table, std::string_view key, control::ArmVector& posture_rad) {
  std::array<double, control::kArmJoints> posture_deg{};
  const std::span<double, control::kArmJoints> rad(posture_rad.data(), posture_deg.size());
  std::ranges::transform(rad, posture_deg.begin(), [](double value_rad) { return value_rad / kDegree; });
  table.numbers(key, posture_deg, {.min = -360, .max = 360});
  std::ranges::transform(posture_deg, rad.begin(), [](double value_deg) { return value_deg * kDegree; });
  if (!table.has(key)) return;
  const control::RobotModel model;
  for (std::size_t i = 0; i < rad.size(); ++i)
    if (const auto& [lower_rad, upper_rad] = model.ranges()[i]; rad[i] < lower_rad || rad[i] > upper_rad)
      table.refuse(key, fmt::format("has {:g} for joint {}, allowed is {:.1f} to {:.1f}", posture_deg[i],
                                    i + 1, lower_rad / kDegree, upper_rad / kDegree));
}

void read_start(TomlTable table, Teleoperation::Config& control) {
  table.number("centring_N_per_m", control.centring.stiffness_N_per_m, {.min = 0, .max = 500});
  table.number("centring_N_s_per_m", control.centring.damping_N_s_per_m, {.min = 0, .max = 20});
  table.number("centred_within_m", control.centred_within_m, {.min = 0.001, .max = 0.1});
  read_posture(table, "unfolded_deg", control.unfolded_rad);
  table.number("unfolding_rad_per_s", control.unfolding_speed_rad_per_s, {.min = 0.01, .max = 1.0});
  read_degrees(table, "unfolded_within_deg", control.unfolded_within_rad, 0.1, 20);
  table.numbers("position_m", std::span(control.start_p_WT_m.data(), 3), {.min = -1, .max = 1});
  read_degrees(table, "pitch_deg", control.start_pitch_rad, 0, 180);
  table.number("approach_s", control.approach_s, {.min = 1, .max = 60});
  table.number("arrived_within_m", control.arrived_within_m, {.min = 0.0005, .max = 0.1});
  read_degrees(table, "arrived_within_deg", control.arrived_within_rad, 0.1, 20);
  table.number("slack_N", control.slack_N, {.min = 0.001, .max = 10});
  table.number("resting_m_per_s", control.resting_speed_m_per_s, {.min = 0.001, .max = 0.1});
  table.number("feedback_fade_s", control.feedback_fade_s, {.min = 0.01, .max = 60});
  table.number("stop_timeout_s", control.stop_timeout_s, {.min = 0.1, .max = 60});
  table.number("lowering_s", control.lowering_s, {.min = 0.5, .max = 60});
  table.number("centring_timeout_s", control.centring_timeout_s, {.min = 1, .max = 600});
  table.number("unfolding_timeout_s", control.unfolding_timeout_s, {.min = 1, .max = 600});
  table.number("approach_timeout_s", control.approach_timeout_s, {.min = 1, .max = 600});
}

void read_coupling(TomlTable table, Teleoperation::Config& control) {
  read_stiffness(table, "soft", control.soft);
  read_stiffness(table, "stiff", control.stiff);
  const auto refuse_softer = [&table](std::string_view unit, double stiff, double soft) {
    if (stiff < soft)
      table.refuse(fmt::format("stiff_{}", unit),
                   fmt::format("is {:g}, allowed is at least 'teleoperation.coupling.soft_{}', which is {:g}",
                               stiff, unit, soft));
  };
  refuse_softer("N_per_m", control.stiff.translation_N_per_m, control.soft.translation_N_per_m);
  refuse_softer("Nm_per_rad", control.stiff.rotation_Nm_per_rad, control.soft.rotation_Nm_per_rad);
  table.number("stiffening_N_per_m_s", control.stiffening_per_s.translation_N_per_m, {.min = 1, .max = 1e5});
  table.number("stiffening_Nm_per_rad_s", control.stiffening_per_s.rotation_Nm_per_rad,
               {.min = 0.1, .max = 1e4});
  control::CartesianSpring::Config& spring = control.robot.spring;
  table.number("damping_ratio", spring.damping_ratio, {.min = 0.05, .max = 3});
  table.number("force_limit_N", spring.force_limit_N, {.min = 1, .max = 200});
  table.number("moment_limit_Nm", spring.moment_limit_Nm, {.min = 0.1, .max = 50});
  table.number("setpoint_distance_limit_m", control.setpoint_distance_limit_m, {.min = 0.05, .max = 5});
  read_degrees(table, "setpoint_turn_limit_deg", control.setpoint_turn_limit_rad, 5, 170);
}

void read_mapping(TomlTable table, control::HapticMapping::Config& mapping,
                  control::SetpointSmoothing::Config& smoothing) {
  table.number("motion_scale", mapping.motion_scale, {.min = 0.01, .max = 10});
  table.boolean("follow_rotation", mapping.follow_rotation);
  table.number("smoothing_m_per_s", smoothing.speed_m_per_s, {.min = 0.001, .max = 2});
  table.number("smoothing_m_per_s2", smoothing.acceleration_m_per_s2, {.min = 0.1, .max = 50});
  table.number("smoothing_m_per_s3", smoothing.jerk_m_per_s3, {.min = 10, .max = 50'000});
  table.number("smoothing_threshold_m", smoothing.threshold_m, {.min = 1e-6, .max = 0.1});
  read_degrees(table, "smoothing_deg_per_s", smoothing.turn_speed_rad_per_s, 0.1, 360);
  read_degrees(table, "smoothing_deg_per_s2", smoothing.turn_acceleration_rad_per_s2, 10, 5000);
  read_degrees(table, "smoothing_deg_per_s3", smoothing.turn_jerk_rad_per_s3, 1000, 5e6);
  read_degrees(table, "smoothing_threshold_deg", smoothing.turn_threshold_rad, 0.001, 20);
  table.number("rate_m_per_s", mapping.rate_speed_m_per_s, {.min = 0.001, .max = 1});
  table.number("leash_m", mapping.leash_m, {.min = 0.001, .max = 1});
  read_degrees(table, "turn_leash_deg", mapping.turn_leash_rad, 0.1, 90);
  table.number("rest_deflection_m", mapping.rest_deflection_m, {.min = 0, .max = 1});
  table.number("full_deflection_m", mapping.full_deflection_m, {.min = 0.001, .max = 1});
  read_degrees(table, "rest_turn_deg", mapping.rest_turn_rad, 0, 90);
  read_degrees(table, "full_turn_deg", mapping.full_turn_rad, 0.1, 180);
  read_degrees(table, "rate_turn_deg_per_s", mapping.rate_turn_rad_per_s, 0.1, 90);
  if (!(mapping.full_deflection_m > mapping.rest_deflection_m))
    table.refuse("full_deflection_m", "is not more than 'teleoperation.mapping.rest_deflection_m'");
  if (!(mapping.full_turn_rad > mapping.rest_turn_rad))
    table.refuse("full_turn_deg", "is not more than 'teleoperation.mapping.rest_turn_deg'");
  control::RateBoundary& boundary = mapping.boundary;
  table.numbers("boundary_centre_m", std::span(boundary.centre_H_m.data(), 3), {.min = -1, .max = 1});
  table.numbers("boundary_half_axes_m", std::span(boundary.half_axes_m.data(), 3), {.min = 0.001, .max = 1});
  table.number("boundary_least_x_m", boundary.least_x_m, {.min = -1, .max = 1});
  table.number("boundary_least_z_m", boundary.least_z_m, {.min = -1, .max = 1});
  table.number("rim_N_per_m", boundary.rim_N_per_m, {.min = 0, .max = 1000});
  if (!boundary.inside(Eigen::Vector3d::Zero()))
    table.refuse("boundary_centre_m", "and the other keys of the boundary leave the handle's origin outside");
}

void read_feedback(TomlTable table, Teleoperation::Config& control) {
  table.boolean("enabled", control.force_feedback);
  table.number("force_scale", control.feedback.force_scale, {.min = 0.1, .max = 1000});
  table.number("force_limit_N", control.feedback.force_limit_N, {.min = 0.1, .max = 12});
  table.number("contact_share", control.feedback.contact_share, {.min = 0, .max = 1});
  table.boolean("passivity", control.tank.active);
  if (control.feedback.contact_share > 0 && !control.tank.active)
    table.refuse("contact_share", "needs 'teleoperation.feedback.passivity': the observed force comes late");
  table.number("reserve_J", control.tank.reserve_J, {.min = 1e-5, .max = 1});
  table.number("damping_N_s_per_m", control.tank.damping_N_s_per_m, {.min = 0, .max = 50});
  table.boolean("detect_release", control.detect_release);
  table.number("device_mass_kg", control.presence.device_mass_kg, {.min = 0.01, .max = 5});
  table.number("device_drag_N_s_per_m", control.presence.device_drag_N_s_per_m, {.min = 0, .max = 50});
  table.number("telling_force_N", control.presence.telling_force_N, {.min = 0.01, .max = 8});
  table.number("released_share", control.presence.released_share, {.min = 0.01, .max = 0.9});
  table.number("felt_hand_N", control.presence.felt_hand_N, {.min = 0.001, .max = 8});
  table.number("unfelt_after_s", control.presence.unfelt_after_s, {.min = 0.005, .max = 10});
  table.number("released_impulse_N_s", control.presence.released_impulse_N_s, {.min = 0.001, .max = 10});
}

void read_buttons(TomlTable table, Teleoperation::Config& control) {
  table.integer("gripper", control.gripper_button, {.min = -1, .max = 31});
  table.integer("clutch", control.clutch_button, {.min = -1, .max = 31});
  if (control.gripper_button >= 0 && control.gripper_button == control.clutch_button)
    table.refuse("clutch", "and 'gripper' are the same button");
  table.number("gripper_closed_m", control.gripper_closed_m, {.min = 0, .max = 0.023});
  table.number("gripper_open_m", control.gripper_open_m, {.min = 0, .max = 0.023});
}

void take(const runtime::ArmModel& model, control::WholeBodyController::Config& robot) {
  robot.model = model.changes;
  robot.arm_friction = model.friction;
  robot.rotor_inertia_kg_m2 = model.rotor_inertia_kg_m2;
}

/// What the joints need to hold the arm still.
control::ArmVector weight_Nm(control::RobotModel& model, const control::ArmVector& posture_rad) {
  model.update((control::ChainVector() << 0, 0, 0, posture_rad).finished());
  return model.gravity_Nm().tail<control::kArmJoints>().cwiseAbs();
}

/// Where the arm has to hold still before its operator can move it.
struct HeldPosture {
  std::vector<std::string_view> start_keys;  ///< that determine it; messages name it by the first
  control::ArmVector rad;
};

struct Weight {
  std::size_t joint;
  double needed_Nm;
  double limit_Nm;
  bool usual_arm_fits;  ///< the arm of control/youbot.urdf, without payload
};

/// At the key that a setting changed, or else at the one that makes the arm heavier than usual.
void refuse_weight(const Weight& weight, const HeldPosture& posture, const std::optional<ArmFile>& file,
                   TomlTable& start, TomlTable& arm) {
  const std::string needs =
      fmt::format("at 'teleoperation.start.{}', arm_joint_{} needs {:.2f} N·m to hold the arm",
                  posture.start_keys.front(), weight.joint + 1, weight.needed_Nm);
  const std::string remedy =
      fmt::format("; its limit of {:g} allows {:.2f}: lighten the load or choose another start",
                  weight.limit_Nm, kMaxWeightShare * weight.limit_Nm);
  const auto set_key =
      std::ranges::find_if(posture.start_keys, [&](std::string_view key) { return start.is_set(key); });
  const bool start_is_set = set_key != posture.start_keys.end();
  if (arm.is_set("torque_limit_Nm") || (!start_is_set && !weight.usual_arm_fits))
    arm.refuse("torque_limit_Nm", fmt::format("is too low: {}, so at least {:.2f}", needs,
                                              std::ceil(100 * weight.needed_Nm / kMaxWeightShare) / 100));
  else if (start_is_set)
    start.refuse(*set_key, "leads to a posture that needs too much torque: " + needs + remedy);
  else if (file && !arm.is_set("payload_kg"))
    arm.refuse("robot_file", "names " + file->path.string() + ", whose arm is too heavy: " + needs + remedy);
  else
    arm.refuse("payload_kg", "makes the arm too heavy: " + needs + remedy);
}

void check_weight(const Teleoperation::Config& control, const std::optional<ArmFile>& file, TomlTable& start,
                  TomlTable& arm) {
  control::RobotModel model(control.robot.model);
  control::RobotModel usual;
  std::vector<HeldPosture> postures{{{"unfolded_deg"}, control.unfolded_rad}};
  try {
    postures.push_back({{"position_m", "pitch_deg", "unfolded_deg"}, control::start_posture(control, model)});
  } catch (const std::invalid_argument&) {
    return;  // refused later, with its reason: no such start
  }
  for (const HeldPosture& posture : postures) {
    const control::ArmVector needed_Nm = weight_Nm(model, posture.rad);
    const control::ArmVector usual_Nm = weight_Nm(usual, posture.rad);
    for (std::size_t i = 0; i < control.robot.arm_torque_limit_Nm.size(); ++i) {
      const auto joint = static_cast<Eigen::Index>(i);
      const double limit_Nm = control.robot.arm_torque_limit_Nm[i];
      const double allowed_Nm = kMaxWeightShare * limit_Nm;
      if (needed_Nm[joint] > allowed_Nm)
        refuse_weight({.joint = i,
                       .needed_Nm = needed_Nm[joint],
                       .limit_Nm = limit_Nm,
                       .usual_arm_fits = usual_Nm[joint] <= allowed_Nm},
                      posture, file, start, arm);
    }
  }
}

std::optional<ArmFile> read_arm(TomlTable table, const std::filesystem::path& folder,
                                Teleoperation::Config& control) {
  control::WholeBodyController::Config& robot = control.robot;
  std::optional<ArmFile> file = read_arm_file(table, "robot_file", folder);
  if (file) take(file->model, robot);
  if (file)
    for (const std::string_view key : {"coulomb_Nm", "viscous_Nm_s_per_rad", "payload_kg"})
      if (table.has(key) && !table.is_set(key))
        table.refuse(key,
                     "is given by the file of 'teleoperation.arm.robot_file' too: remove one of the two");
  const runtime::NumberRules friction{.min = 0, .max = runtime::kMaxJointFriction};
  table.numbers("coulomb_Nm", robot.arm_friction.coulomb_Nm, friction);
  table.numbers("viscous_Nm_s_per_rad", robot.arm_friction.viscous_Nm_s_per_rad, friction);
  table.number("compensation_margin", robot.arm_compensator.margin, {.min = 0, .max = 1});
  table.number("full_command_Nm", robot.arm_compensator.full_command_Nm, {.min = 1e-4, .max = 5});
  table.numbers("torque_limit_Nm", robot.arm_torque_limit_Nm, {.min = 0.1, .max = 15});
  table.number("posture_Nm_per_rad", robot.posture_stiffness_Nm_per_rad, {.min = 0.01, .max = 100});
  table.number("posture_Nm_s_per_rad", robot.posture_damping_Nm_s_per_rad, {.min = 0.01, .max = 50});
  table.number("posture_limit_Nm", robot.posture_torque_limit_Nm, {.min = 0.01, .max = 20});
  table.number("joint_speed_limit_rad_per_s", control.joint_speed_limit_rad_per_s, {.min = 0.1, .max = 10});
  table.number("setpoint_rad_per_s", control.joint_setpoint.speed, {.min = 0.01, .max = 5});
  table.number("setpoint_rad_per_s2", control.joint_setpoint.acceleration, {.min = 0.1, .max = 50});
  table.number("setpoint_rad_per_s3", control.joint_setpoint.jerk, {.min = 10, .max = 50'000});
  table.number("following_error_rad", control.joint_following_error_rad, {.min = 0.02, .max = 3});
  table.number("payload_kg", robot.model.payload_kg, {.min = 0, .max = runtime::kMaxPayload_kg});
  return file;
}

}  // namespace

std::optional<ArmFile> read_teleoperation(TomlTable table, const std::filesystem::path& folder,
                                          Teleoperation::Config& control) {
  TomlTable start = table.table("start");
  read_start(start, control);
  read_coupling(table.table("coupling"), control);
  read_mapping(table.table("mapping"), control.mapping, control.smoothing);
  read_feedback(table.table("feedback"), control);
  read_buttons(table.table("buttons"), control);
  TomlTable arm = table.table("arm");
  std::optional<ArmFile> file = read_arm(arm, folder, control);
  // The usual arm holds its weight at its usual start. Its model takes most of the time to read a short file.
  if (table.has_table("start") || table.has_table("arm")) check_weight(control, file, start, arm);
  return file;
}

}  // namespace operation
