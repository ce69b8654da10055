#include "operation/setting_bounds.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "runtime/configuration/toml_reader.h"

namespace operation {
namespace {

double in_degrees(double angle_rad) { return angle_rad * 180 / std::numbers::pi; }

enum class Side : std::uint8_t { kAbove, kBelow, kBoth };
struct Bound {
  const char* key;
  double (*value)(const Config& config);
  Side weaker = Side::kAbove;
  bool broken_by(double set, double from_file) const noexcept {
    const bool kept_above = weaker == Side::kBelow || set <= from_file;
    const bool kept_below = weaker == Side::kAbove || set >= from_file;
    return !kept_above || !kept_below;
  }
  const char* text() const noexcept {
    return weaker == Side::kAbove ? "no more than" : weaker == Side::kBelow ? "no less than" : "nothing but";
  }
};
/// Springs, feedforward and compensation, of friction and of a payload's weight, may not push harder or
/// sooner. Damping of the base brakes, and a speed limit depends on the velocity filter. The conditions of
/// each start-up step may not become looser, nor its time-outs longer. Accelerations and jerks are as in the
/// file: more is faster, less stops later. So is damping of the hand, the end effector and the posture: with
/// less they oscillate, with more their sampled velocity injects energy. Release detection uses the mass and
/// drag of the handle.
constexpr auto kBounds = std::to_array<Bound>(
    {{"limits.force_N", [](const Config& c) { return c.cycle.controller.wrench_limits.force_N; }},
     {"limits.moment_Nm", [](const Config& c) { return c.cycle.controller.wrench_limits.moment_Nm; }},
     {"limits.wheel_torque_Nm", [](const Config& c) { return c.cycle.controller.torque_limit_Nm; }},
     {"limits.wheel_speed_rad_per_s", [](const Config& c) { return c.cycle.wheel_speed_limit_rad_per_s; }},
     {"limits.setpoint_m_per_s", [](const Config& c) { return c.cycle.setpoint.linear.speed; }},
     {"limits.setpoint_m_per_s2", [](const Config& c) { return c.cycle.setpoint.linear.acceleration; },
      Side::kBoth},
     {"limits.setpoint_m_per_s3", [](const Config& c) { return c.cycle.setpoint.linear.jerk; }, Side::kBoth},
     {"limits.setpoint_rad_per_s", [](const Config& c) { return c.cycle.setpoint.turning.speed; }},
     {"limits.setpoint_rad_per_s2", [](const Config& c) { return c.cycle.setpoint.turning.acceleration; },
      Side::kBoth},
     {"limits.setpoint_rad_per_s3", [](const Config& c) { return c.cycle.setpoint.turning.jerk; },
      Side::kBoth},
     {"limits.torque_rate_per_s", [](const Config& c) { return c.cycle.torque_rate_per_s; }},
     {"limits.following_error_m", [](const Config& c) { return c.cycle.following_error_m; }},
     {"limits.following_error_rad", [](const Config& c) { return c.cycle.following_error_rad; }},
     {"workspace.base_x_m[0]", [](const Config& c) { return c.cycle.workspace.base_W_m.min().x(); },
      Side::kBelow},
     {"workspace.base_x_m[1]", [](const Config& c) { return c.cycle.workspace.base_W_m.max().x(); }},
     {"workspace.base_y_m[0]", [](const Config& c) { return c.cycle.workspace.base_W_m.min().y(); },
      Side::kBelow},
     {"workspace.base_y_m[1]", [](const Config& c) { return c.cycle.workspace.base_W_m.max().y(); }},
     {"workspace.tip_x_m[0]", [](const Config& c) { return c.cycle.workspace.tip_W_m.min().x(); },
      Side::kBelow},
     {"workspace.tip_x_m[1]", [](const Config& c) { return c.cycle.workspace.tip_W_m.max().x(); }},
     {"workspace.tip_y_m[0]", [](const Config& c) { return c.cycle.workspace.tip_W_m.min().y(); },
      Side::kBelow},
     {"workspace.tip_y_m[1]", [](const Config& c) { return c.cycle.workspace.tip_W_m.max().y(); }},
     {"workspace.tip_z_m[0]", [](const Config& c) { return c.cycle.workspace.tip_W_m.min().z(); },
      Side::kBelow},
     {"workspace.tip_z_m[1]", [](const Config& c) { return c.cycle.workspace.tip_W_m.max().z(); }},
     {"controller.stiffness_N_per_m", [](const Config& c) { return c.cycle.controller.stiffness[0]; }},
     {"controller.turning_stiffness_Nm_per_rad",
      [](const Config& c) { return c.cycle.controller.stiffness[2]; }},
     {"controller.feedforward_mass_kg",
      [](const Config& c) { return c.cycle.controller.feedforward_inertia[0]; }},
     {"controller.feedforward_inertia_kg_m2",
      [](const Config& c) { return c.cycle.controller.feedforward_inertia[2]; }},
     {"controller.damping_N_s_per_m", [](const Config& c) { return c.cycle.controller.damping[0]; },
      Side::kBelow},
     {"controller.turning_damping_Nm_s_per_rad",
      [](const Config& c) { return c.cycle.controller.damping[2]; }, Side::kBelow},
     {"compensation.margin", [](const Config& c) { return c.cycle.controller.compensator.margin; }},
     {"compensation.factors[0]", [](const Config& c) { return c.cycle.controller.friction_factor[0]; }},
     {"compensation.factors[1]", [](const Config& c) { return c.cycle.controller.friction_factor[1]; }},
     {"compensation.factors[2]", [](const Config& c) { return c.cycle.controller.friction_factor[2]; }},
     {"compensation.factors[3]", [](const Config& c) { return c.cycle.controller.friction_factor[3]; }},
     {"compensation.adapt_up_to", [](const Config& c) { return c.cycle.controller.adaptation.greatest; }},
     {"compensation.filter_damping",
      [](const Config& c) { return c.cycle.controller.observer.filter.damping; }},
     {"compensation.full_command_Nm",
      [](const Config& c) { return c.cycle.controller.compensator.full_command_Nm; }, Side::kBelow},
     {"compensation.blend_speed_rad_per_s",
      [](const Config& c) { return c.cycle.controller.observer.blend_speed_rad_per_s; }, Side::kBelow},
     {"compensation.filter_cutoff_rad_per_s",
      [](const Config& c) { return c.cycle.controller.observer.filter.cutoff_rad_per_s; }, Side::kBelow},
     {"path.speed_m_per_s", [](const Config& c) { return c.path.limits.speed_m_per_s; }},
     {"path.acceleration_m_per_s2", [](const Config& c) { return c.path.limits.acceleration_m_per_s2; },
      Side::kBoth},
     {"path.turn_speed_rad_per_s", [](const Config& c) { return c.path.limits.turn_speed_rad_per_s; }},
     {"path.turn_acceleration_rad_per_s2",
      [](const Config& c) { return c.path.limits.turn_acceleration_rad_per_s2; }, Side::kBoth},
     {"teleoperation.start.centring_N_per_m",
      [](const Config& c) { return c.teleoperation.centring.stiffness_N_per_m; }},
     {"teleoperation.start.centring_N_s_per_m",
      [](const Config& c) { return c.teleoperation.centring.damping_N_s_per_m; }, Side::kBoth},
     {"teleoperation.start.centred_within_m",
      [](const Config& c) { return c.teleoperation.centred_within_m; }},
     {"teleoperation.start.unfolding_rad_per_s",
      [](const Config& c) { return c.teleoperation.unfolding_speed_rad_per_s; }},
     {"teleoperation.start.unfolded_within_deg",
      [](const Config& c) { return in_degrees(c.teleoperation.unfolded_within_rad); }},
     {"teleoperation.start.arrived_within_m",
      [](const Config& c) { return c.teleoperation.arrived_within_m; }},
     {"teleoperation.start.arrived_within_deg",
      [](const Config& c) { return in_degrees(c.teleoperation.arrived_within_rad); }},
     {"teleoperation.start.slack_N", [](const Config& c) { return c.teleoperation.slack_N; }},
     {"teleoperation.start.resting_m_per_s",
      [](const Config& c) { return c.teleoperation.resting_speed_m_per_s; }},
     {"teleoperation.start.centring_timeout_s",
      [](const Config& c) { return c.teleoperation.centring_timeout_s; }},
     {"teleoperation.start.unfolding_timeout_s",
      [](const Config& c) { return c.teleoperation.unfolding_timeout_s; }},
     {"teleoperation.start.approach_timeout_s",
      [](const Config& c) { return c.teleoperation.approach_timeout_s; }},
     {"teleoperation.start.stop_timeout_s", [](const Config& c) { return c.teleoperation.stop_timeout_s; }},
     {"teleoperation.start.approach_s", [](const Config& c) { return c.teleoperation.approach_s; },
      Side::kBelow},
     {"teleoperation.start.feedback_fade_s", [](const Config& c) { return c.teleoperation.feedback_fade_s; },
      Side::kBelow},
     {"teleoperation.start.lowering_s", [](const Config& c) { return c.teleoperation.lowering_s; },
      Side::kBelow},
     {"teleoperation.coupling.soft_N_per_m",
      [](const Config& c) { return c.teleoperation.soft.translation_N_per_m; }},
     {"teleoperation.coupling.soft_Nm_per_rad",
      [](const Config& c) { return c.teleoperation.soft.rotation_Nm_per_rad; }},
     {"teleoperation.coupling.stiff_N_per_m",
      [](const Config& c) { return c.teleoperation.stiff.translation_N_per_m; }},
     {"teleoperation.coupling.stiff_Nm_per_rad",
      [](const Config& c) { return c.teleoperation.stiff.rotation_Nm_per_rad; }},
     {"teleoperation.coupling.stiffening_N_per_m_s",
      [](const Config& c) { return c.teleoperation.stiffening_per_s.translation_N_per_m; }},
     {"teleoperation.coupling.stiffening_Nm_per_rad_s",
      [](const Config& c) { return c.teleoperation.stiffening_per_s.rotation_Nm_per_rad; }},
     {"teleoperation.coupling.force_limit_N",
      [](const Config& c) { return c.teleoperation.robot.spring.force_limit_N; }},
     {"teleoperation.coupling.moment_limit_Nm",
      [](const Config& c) { return c.teleoperation.robot.spring.moment_limit_Nm; }},
     {"teleoperation.coupling.setpoint_distance_limit_m",
      [](const Config& c) { return c.teleoperation.setpoint_distance_limit_m; }},
     {"teleoperation.coupling.setpoint_turn_limit_deg",
      [](const Config& c) { return in_degrees(c.teleoperation.setpoint_turn_limit_rad); }},
     {"teleoperation.coupling.damping_ratio",
      [](const Config& c) { return c.teleoperation.robot.spring.damping_ratio; }, Side::kBoth},
     {"teleoperation.mapping.motion_scale",
      [](const Config& c) { return c.teleoperation.mapping.motion_scale; }},
     {"teleoperation.mapping.smoothing_m_per_s",
      [](const Config& c) { return c.teleoperation.smoothing.speed_m_per_s; }},
     {"teleoperation.mapping.smoothing_m_per_s2",
      [](const Config& c) { return c.teleoperation.smoothing.acceleration_m_per_s2; }, Side::kBoth},
     {"teleoperation.mapping.smoothing_m_per_s3",
      [](const Config& c) { return c.teleoperation.smoothing.jerk_m_per_s3; }, Side::kBoth},
     {"teleoperation.mapping.smoothing_threshold_m",
      [](const Config& c) { return c.teleoperation.smoothing.threshold_m; }},
     {"teleoperation.mapping.smoothing_deg_per_s",
      [](const Config& c) { return in_degrees(c.teleoperation.smoothing.turn_speed_rad_per_s); }},
     {"teleoperation.mapping.smoothing_deg_per_s2",
      [](const Config& c) { return in_degrees(c.teleoperation.smoothing.turn_acceleration_rad_per_s2); },
      Side::kBoth},
     {"teleoperation.mapping.smoothing_deg_per_s3",
      [](const Config& c) { return in_degrees(c.teleoperation.smoothing.turn_jerk_rad_per_s3); },
      Side::kBoth},
     {"teleoperation.mapping.smoothing_threshold_deg",
      [](const Config& c) { return in_degrees(c.teleoperation.smoothing.turn_threshold_rad); }},
     {"teleoperation.mapping.rate_m_per_s",
      [](const Config& c) { return c.teleoperation.mapping.rate_speed_m_per_s; }},
     {"teleoperation.mapping.rate_turn_deg_per_s",
      [](const Config& c) { return in_degrees(c.teleoperation.mapping.rate_turn_rad_per_s); }},
     {"teleoperation.mapping.leash_m", [](const Config& c) { return c.teleoperation.mapping.leash_m; }},
     {"teleoperation.mapping.turn_leash_deg",
      [](const Config& c) { return in_degrees(c.teleoperation.mapping.turn_leash_rad); }},
     {"teleoperation.mapping.rim_N_per_m",
      [](const Config& c) { return c.teleoperation.mapping.boundary.rim_N_per_m; }},
     {"teleoperation.mapping.rest_deflection_m",
      [](const Config& c) { return c.teleoperation.mapping.rest_deflection_m; }, Side::kBelow},
     {"teleoperation.mapping.full_deflection_m",
      [](const Config& c) { return c.teleoperation.mapping.full_deflection_m; }, Side::kBelow},
     {"teleoperation.mapping.rest_turn_deg",
      [](const Config& c) { return in_degrees(c.teleoperation.mapping.rest_turn_rad); }, Side::kBelow},
     {"teleoperation.mapping.full_turn_deg",
      [](const Config& c) { return in_degrees(c.teleoperation.mapping.full_turn_rad); }, Side::kBelow},
     {"teleoperation.mapping.boundary_centre_m[0]",
      [](const Config& c) { return c.teleoperation.mapping.boundary.centre_H_m[0]; }, Side::kBoth},
     {"teleoperation.mapping.boundary_centre_m[1]",
      [](const Config& c) { return c.teleoperation.mapping.boundary.centre_H_m[1]; }, Side::kBoth},
     {"teleoperation.mapping.boundary_centre_m[2]",
      [](const Config& c) { return c.teleoperation.mapping.boundary.centre_H_m[2]; }, Side::kBoth},
     {"teleoperation.mapping.boundary_half_axes_m[0]",
      [](const Config& c) { return c.teleoperation.mapping.boundary.half_axes_m[0]; }, Side::kBoth},
     {"teleoperation.mapping.boundary_half_axes_m[1]",
      [](const Config& c) { return c.teleoperation.mapping.boundary.half_axes_m[1]; }, Side::kBoth},
     {"teleoperation.mapping.boundary_half_axes_m[2]",
      [](const Config& c) { return c.teleoperation.mapping.boundary.half_axes_m[2]; }, Side::kBoth},
     {"teleoperation.mapping.boundary_least_x_m",
      [](const Config& c) { return c.teleoperation.mapping.boundary.least_x_m; }, Side::kBoth},
     {"teleoperation.mapping.boundary_least_z_m",
      [](const Config& c) { return c.teleoperation.mapping.boundary.least_z_m; }, Side::kBoth},
     {"teleoperation.feedback.force_limit_N",
      [](const Config& c) { return c.teleoperation.feedback.force_limit_N; }},
     {"teleoperation.feedback.reserve_J", [](const Config& c) { return c.teleoperation.tank.reserve_J; }},
     {"teleoperation.feedback.telling_force_N",
      [](const Config& c) { return c.teleoperation.presence.telling_force_N; }},
     {"teleoperation.feedback.released_impulse_N_s",
      [](const Config& c) { return c.teleoperation.presence.released_impulse_N_s; }},
     {"teleoperation.feedback.unfelt_after_s",
      [](const Config& c) { return c.teleoperation.presence.unfelt_after_s; }},
     {"teleoperation.feedback.force_scale",
      [](const Config& c) { return c.teleoperation.feedback.force_scale; }, Side::kBelow},
     {"teleoperation.feedback.released_share",
      [](const Config& c) { return c.teleoperation.presence.released_share; }, Side::kBelow},
     {"teleoperation.feedback.felt_hand_N",
      [](const Config& c) { return c.teleoperation.presence.felt_hand_N; }, Side::kBelow},
     {"teleoperation.feedback.damping_N_s_per_m",
      [](const Config& c) { return c.teleoperation.tank.damping_N_s_per_m; }, Side::kBoth},
     {"teleoperation.feedback.device_mass_kg",
      [](const Config& c) { return c.teleoperation.presence.device_mass_kg; }, Side::kBoth},
     {"teleoperation.feedback.device_drag_N_s_per_m",
      [](const Config& c) { return c.teleoperation.presence.device_drag_N_s_per_m; }, Side::kBoth},
     {"teleoperation.arm.torque_limit_Nm[0]",
      [](const Config& c) { return c.teleoperation.robot.arm_torque_limit_Nm[0]; }},
     {"teleoperation.arm.torque_limit_Nm[1]",
      [](const Config& c) { return c.teleoperation.robot.arm_torque_limit_Nm[1]; }},
     {"teleoperation.arm.torque_limit_Nm[2]",
      [](const Config& c) { return c.teleoperation.robot.arm_torque_limit_Nm[2]; }},
     {"teleoperation.arm.torque_limit_Nm[3]",
      [](const Config& c) { return c.teleoperation.robot.arm_torque_limit_Nm[3]; }},
     {"teleoperation.arm.torque_limit_Nm[4]",
      [](const Config& c) { return c.teleoperation.robot.arm_torque_limit_Nm[4]; }},
     {"teleoperation.arm.coulomb_Nm[0]",
      [](const Config& c) { return c.teleoperation.robot.arm_friction.coulomb_Nm[0]; }},
     {"teleoperation.arm.coulomb_Nm[1]",
      [](const Config& c) { return c.teleoperation.robot.arm_friction.coulomb_Nm[1]; }},
     {"teleoperation.arm.coulomb_Nm[2]",
      [](const Config& c) { return c.teleoperation.robot.arm_friction.coulomb_Nm[2]; }},
     {"teleoperation.arm.coulomb_Nm[3]",
      [](const Config& c) { return c.teleoperation.robot.arm_friction.coulomb_Nm[3]; }},
     {"teleoperation.arm.coulomb_Nm[4]",
      [](const Config& c) { return c.teleoperation.robot.arm_friction.coulomb_Nm[4]; }},
     {"teleoperation.arm.viscous_Nm_s_per_rad[0]",
      [](const Config& c) { return c.teleoperation.robot.arm_friction.viscous_Nm_s_per_rad[0]; }},
     {"teleoperation.arm.viscous_Nm_s_per_rad[1]",
      [](const Config& c) { return c.teleoperation.robot.arm_friction.viscous_Nm_s_per_rad[1]; }},
     {"teleoperation.arm.viscous_Nm_s_per_rad[2]",
      [](const Config& c) { return c.teleoperation.robot.arm_friction.viscous_Nm_s_per_rad[2]; }},
     {"teleoperation.arm.viscous_Nm_s_per_rad[3]",
      [](const Config& c) { return c.teleoperation.robot.arm_friction.viscous_Nm_s_per_rad[3]; }},
     {"teleoperation.arm.viscous_Nm_s_per_rad[4]",
      [](const Config& c) { return c.teleoperation.robot.arm_friction.viscous_Nm_s_per_rad[4]; }},
     {"teleoperation.arm.compensation_margin",
      [](const Config& c) { return c.teleoperation.robot.arm_compensator.margin; }},
     {"teleoperation.arm.payload_kg", [](const Config& c) { return c.teleoperation.robot.model.payload_kg; }},
     {"teleoperation.arm.posture_Nm_per_rad",
      [](const Config& c) { return c.teleoperation.robot.posture_stiffness_Nm_per_rad; }},
     {"teleoperation.arm.posture_limit_Nm",
      [](const Config& c) { return c.teleoperation.robot.posture_torque_limit_Nm; }},
     {"teleoperation.arm.joint_speed_limit_rad_per_s",
      [](const Config& c) { return c.teleoperation.joint_speed_limit_rad_per_s; }},
     {"teleoperation.arm.setpoint_rad_per_s",
      [](const Config& c) { return c.teleoperation.joint_setpoint.speed; }},
     {"teleoperation.arm.setpoint_rad_per_s2",
      [](const Config& c) { return c.teleoperation.joint_setpoint.acceleration; }, Side::kBoth},
     {"teleoperation.arm.setpoint_rad_per_s3",
      [](const Config& c) { return c.teleoperation.joint_setpoint.jerk; }, Side::kBoth},
     {"teleoperation.arm.following_error_rad",
      [](const Config& c) { return c.teleoperation.joint_following_error_rad; }},
     {"teleoperation.arm.full_command_Nm",
      [](const Config& c) { return c.teleoperation.robot.arm_compensator.full_command_Nm; }, Side::kBelow},
     {"teleoperation.arm.posture_Nm_s_per_rad",
      [](const Config& c) { return c.teleoperation.robot.posture_damping_Nm_s_per_rad; }, Side::kBoth}});

/// Settings that may be switched in one direction only.
struct Switch {
  const char* key;
  bool (*on)(const Config& config);
  bool protects;  ///< otherwise it moves, pushes or helps
};
constexpr auto kSwitches = std::to_array<Switch>(
    {{"compensation.enabled", [](const Config& c) { return c.cycle.controller.compensate_friction; }, false},
     {"compensation.adapt", [](const Config& c) { return c.cycle.controller.adapt; }, false},
     {"teleoperation.mapping.follow_rotation",
      [](const Config& c) { return c.teleoperation.mapping.follow_rotation; }, false},
     {"teleoperation.feedback.enabled", [](const Config& c) { return c.teleoperation.force_feedback; },
      false},
     {"teleoperation.feedback.passivity", [](const Config& c) { return c.teleoperation.tank.active; }, true},
     {"teleoperation.feedback.detect_release", [](const Config& c) { return c.teleoperation.detect_release; },
      true}});

}  // namespace

void require_no_weaker(const Config& set, const Config& from_file, const std::filesystem::path& file) {
  std::vector<std::string> problems;
  for (const Bound& bound : kBounds)
    if (bound.broken_by(bound.value(set), bound.value(from_file)))
      problems.push_back(fmt::format("set: '{}' is {}, and {} allows {} {}", bound.key, bound.value(set),
                                     file.string(), bound.text(), bound.value(from_file)));
  for (const Switch& one : kSwitches) {
    const bool as_safe = one.on(set) == one.on(from_file) || one.on(set) == one.protects;
    if (!as_safe)
      problems.push_back(fmt::format("set: '{}' is {}, and {} has it {}", one.key, one.on(set), file.string(),
                                     one.on(from_file) ? "on" : "off"));
  }
  if (!set.cycle.checks_off.within(from_file.cycle.checks_off))
    problems.push_back(
        fmt::format("set: 'plausibility.off' switches off a check that {} has on", file.string()));
  if (!problems.empty()) throw runtime::ConfigError(std::move(problems));
}

}  // namespace operation
