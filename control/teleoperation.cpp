#include "control/teleoperation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>

#include "control/arm_posture.h"

namespace control {
namespace {

/// Conditions for the next phase must hold for this time.
constexpr double kHold_s = 0.2;
/// The base counts as at rest below this wheel speed, after that time.
constexpr double kWheelRest_rad_per_s = 0.02;
constexpr double kRestHold_s = 0.05;
constexpr double kJointRest_rad_per_s = 0.02;
/// A joint that lags more than allowed for this time is blocked.
constexpr double kFollowing_s = 0.2;
/// A joint at its end stop may read this far beyond it.
constexpr double kBeyondStop_rad = 0.05;

void require(bool good, const char* name, double value) {
  if (!good)
    throw std::invalid_argument(std::string("teleoperation: ") + name + " = " + std::to_string(value) +
                                " is out of range");
}

Teleoperation::Config checked(const Teleoperation::Config& config) {
  const auto positive = [](double value, const char* name) {
    require(std::isfinite(value) && value > 0, name, value);
  };
  positive(config.period_s, "period_s");
  positive(config.setpoint_distance_limit_m, "setpoint_distance_limit_m");
  positive(config.setpoint_turn_limit_rad, "setpoint_turn_limit_rad");
  require(config.setpoint_turn_limit_rad < std::numbers::pi, "setpoint_turn_limit_rad",
          config.setpoint_turn_limit_rad);
  positive(config.feedback.force_scale, "force_scale");
  positive(config.feedback.force_limit_N, "force_limit_N");
  require(config.feedback.contact_share >= 0 && config.feedback.contact_share <= 1, "contact_share",
          config.feedback.contact_share);
  if (config.feedback.contact_share > 0 && !config.tank.active)
    throw std::invalid_argument("teleoperation: contact_share needs the energy tank: its force comes late");
  positive(config.centred_within_m, "centred_within_m");
  positive(config.unfolding_speed_rad_per_s, "unfolding_speed_rad_per_s");
  positive(config.unfolded_within_rad, "unfolded_within_rad");
  positive(config.joint_setpoint.speed, "joint set-point speed");
  positive(config.joint_setpoint.acceleration, "joint set-point acceleration");
  positive(config.joint_setpoint.jerk, "joint set-point jerk");
  positive(config.joint_following_error_rad, "joint_following_error_rad");
  positive(config.approach_s, "approach_s");
  positive(config.lowering_s, "lowering_s");
  positive(config.arrived_within_m, "arrived_within_m");
  positive(config.arrived_within_rad, "arrived_within_rad");
  positive(config.slack_N, "slack_N");
  positive(config.resting_speed_m_per_s, "resting_speed_m_per_s");
  positive(config.feedback_fade_s, "feedback_fade_s");
  positive(config.stiffening_per_s.translation_N_per_m, "translation stiffening per second");
  positive(config.stiffening_per_s.rotation_Nm_per_rad, "rotation stiffening per second");
  positive(config.soft.translation_N_per_m, "soft translation stiffness");
  positive(config.soft.rotation_Nm_per_rad, "soft rotation stiffness");
  require(config.stiff.translation_N_per_m >= config.soft.translation_N_per_m, "stiff translation stiffness",
          config.stiff.translation_N_per_m);
  require(config.stiff.rotation_Nm_per_rad >= config.soft.rotation_Nm_per_rad, "stiff rotation stiffness",
          config.stiff.rotation_Nm_per_rad);
  if (!config.workspace.tip_W_m.contains(config.start_p_WT_m))
    throw UnreachableStart("teleoperation: the start is outside the end effector's workspace");
  require(config.centring.stiffness_N_per_m >= 0, "centring stiffness", config.centring.stiffness_N_per_m);
  return config;
}

TipPose start_pose(const Teleoperation::Config& config) {
  // Rotated sideways, as joint 1 has to be to point there.
  const double yaw_rad = std::atan2(config.start_p_WT_m.y(), config.start_p_WT_m.x() - kJoint1_x_m);
  return {config.start_p_WT_m,
          Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(config.start_pitch_rad, Eigen::Vector3d::UnitY()))};
}

}  // namespace

ArmVector start_posture(const Teleoperation::Config& config, RobotModel& model) {
  for (int i = 0; i < kArmJoints; ++i) {
    const JointRange& range = model.ranges()[static_cast<std::size_t>(i)];
    require(config.unfolded_rad[i] >= range.lower_rad && config.unfolded_rad[i] <= range.upper_rad,
            "an angle of the unfolded arm, beyond the range of its joint,", config.unfolded_rad[i]);
  }
  // Seed: the unfolded arm, bent slightly in the wanted direction: elbow back, end effector forward.
  const ArmVector bent_rad = config.unfolded_rad + (ArmVector() << 0, -0.4, 0.8, 0.8, 0).finished();
  const std::optional<ArmVector> posture_rad = arm_posture_for(start_pose(config), bent_rad, model);
  if (!posture_rad)
    throw UnreachableStart(
        "teleoperation: the arm cannot reach the start at (" + std::to_string(config.start_p_WT_m.x()) +
        ", " + std::to_string(config.start_p_WT_m.y()) + ", " + std::to_string(config.start_p_WT_m.z()) +
        ") m with a pitch of " + std::to_string(config.start_pitch_rad) + " rad, " +
        std::to_string(config.start_pitch_rad * 180 / std::numbers::pi) + " deg");
  return *posture_rad;
}

namespace {

/// Minimum-jerk profile, 0 to 1 in unit time (Flash and Hogan, J. Neuroscience 5:1688, 1985).
double least_jerk(double t) noexcept { return t < 1 ? t * t * t * (10 + t * (6 * t - 15)) : 1.0; }

SetpointSmoothing::Config within_walls(const Teleoperation::Config& config) noexcept {
  SetpointSmoothing::Config smoothing = config.smoothing;
  smoothing.walls_W_m = config.workspace.tip_W_m;
  return smoothing;
}

/// Shortest duration of a minimum-jerk motion within the limits: its peaks are 15/8 of the mean velocity,
/// 10/√3 of way over time squared, and 60 of way over time cubed.
double shortest_s(double way, const SetpointLimits& limits) noexcept {
  return std::max({15.0 / 8 * way / limits.speed,
                   std::sqrt(10 / std::numbers::sqrt3 * way / limits.acceleration),
                   std::cbrt(60 * way / limits.jerk)});
}

double approached(double value, double target, double step) noexcept {
  return std::clamp(target, value - step, value + step);
}

}  // namespace

const char* name(TeleopPhase phase) noexcept {
  switch (phase) {
    case TeleopPhase::kOff: return "off";
    case TeleopPhase::kCentring: return "centring";
    case TeleopPhase::kUnfolding: return "unfolding";
    case TeleopPhase::kApproaching: return "approaching";
    case TeleopPhase::kStiffening: return "stiffening";
    case TeleopPhase::kOperating: return "operating";
    case TeleopPhase::kLetGo: return "let go";
    case TeleopPhase::kStopping: return "stopping";
    case TeleopPhase::kLowering: return "lowering";
    case TeleopPhase::kFaulted: return "faulted";
  }
  return "unknown";
}

Teleoperation::Teleoperation(const Config& config)
    : config_(checked(config)),
      tuning_(tuning_of(config)),
      hand_force_gain_(1 / config.feedback.force_scale),
      contact_share_(config.feedback.contact_share),
      rate_speed_m_per_s_(config.mapping.rate_speed_m_per_s),
      robot_(config.robot),
      mapping_(config.mapping),
      smoothing_(within_walls(config)),
      tank_(config.tank),
      presence_(config.presence),
      path_model_(config.robot.model),
      start_posture_rad_(start_posture(config, path_model_)) {
  for (std::size_t i = 0; i < speed_proofs_.size(); ++i)
    speed_proofs_[i] = SpeedProof(i < kFirstArmJoint ? config.wheel_speed_limit_rad_per_s
                                                     : config.joint_speed_limit_rad_per_s);
}

TeleopTuning Teleoperation::tuning_of(const Config& config) noexcept {
  return {.stiff = config.stiff,
          .force_scale = config.feedback.force_scale,
          .force_feedback = config.force_feedback,
          .contact_share = config.feedback.contact_share,
          .motion_scale = config.mapping.motion_scale,
          .rate_speed_m_per_s = config.mapping.rate_speed_m_per_s};
}

void Teleoperation::request_stop(TeleopEnd why) noexcept {
  start_ = false;
  if (phase_ != TeleopPhase::kOff && phase_ != TeleopPhase::kFaulted) stop(why);
}

void Teleoperation::switch_off() noexcept {
  start_ = false;
  if (phase_ == TeleopPhase::kOff || phase_ == TeleopPhase::kFaulted) return;
  // The first reason to stop is kept.
  if (phase_ != TeleopPhase::kStopping && phase_ != TeleopPhase::kLowering) end_ = TeleopEnd::kRequested;
  enter(TeleopPhase::kOff);
}

void Teleoperation::stop_after_gap(const TeleopInput& input) noexcept {
  robot_.forget_velocity(input.wheel_position_rad, input.arm_position_rad);
  robot_.sense(input.wheel_position_rad, input.arm_position_rad);
  request_stop(TeleopEnd::kStalled);
}

void Teleoperation::begin(const TeleopInput& input) noexcept {
  start_ = false;
  end_ = TeleopEnd::kNone;
  excess_ = {};
  robot_.reset(input.wheel_position_rad, input.arm_position_rad);
  robot_.sense(input.wheel_position_rad, input.arm_position_rad);
  restart_speeds();
  stiffness_ = {};
  feedback_share_ = rim_share_ = centring_share_ = 0;
  fixed_last_H_N_.setZero();
  fixed_before_H_N_.setZero();
  grip_seen_ = clutched_ = gripper_blocked_ = false;
  mapping_.index(input.grip, tip());
  enter(TeleopPhase::kCentring);
}

const TeleopOutput& Teleoperation::step(const TeleopInput& input) noexcept {
  output_ = {};
  output_.arm_target = hold_rad_;
  if ((phase_ == TeleopPhase::kOff || phase_ == TeleopPhase::kFaulted) && start_)
    begin(input);
  else
    robot_.sense(input.wheel_position_rad, input.arm_position_rad, input.robot_elapsed_s,
                 input.arm_torque_Nm);
  prove_speeds(input);
  in_phase_s_ += config_.period_s;
  check(input);
  switch (phase_) {
    case TeleopPhase::kCentring: centre(input); break;
    case TeleopPhase::kUnfolding: unfold(input); break;
    case TeleopPhase::kApproaching: approach(input); break;
    case TeleopPhase::kStiffening:
    case TeleopPhase::kOperating: operate(input); break;
    case TeleopPhase::kLetGo: wait_for_hand(input); break;
    case TeleopPhase::kStopping: come_to_rest(); break;
    case TeleopPhase::kLowering: lower_arm(); break;
    case TeleopPhase::kOff:
    case TeleopPhase::kFaulted: break;
  }
  if (input.arm_homed && output_.arm == TeleopOutput::Arm::kPosition) keep_in_range(output_.arm_target);
  command_gripper(input);
  command_master(input);
  output_.phase = phase_;
  output_.enable_drives = phase_ != TeleopPhase::kOff && phase_ != TeleopPhase::kFaulted;
  output_.setpoint = smoothing_.setpoint();
  output_.mode = mapping_.mode();
  output_.clutched = clutched_;
  output_.stiffness = stiffness_;
  return output_;
}

void Teleoperation::check(const TeleopInput& input) noexcept {
  if (phase_ == TeleopPhase::kOff || phase_ == TeleopPhase::kFaulted) return;
  // Also before the drives obey: their first command is to hold the measured position.
  if (input.arm_homed) check_range(input.arm_position_rad);
  if (phase_ == TeleopPhase::kFaulted) return;
  const bool started = phase_ > TeleopPhase::kCentring && phase_ < TeleopPhase::kStopping;
  if (input.robot_fault || (started && !input.drives_obey)) return fail(TeleopEnd::kRobotFault);
  const bool ending = phase_ == TeleopPhase::kStopping || phase_ == TeleopPhase::kLowering;
  // Stops if the haptic device has lost its position.
  if (!ending && (input.master_fault || (started && !input.master_ready)))
    return stop(TeleopEnd::kMasterFault);
  // Homing changes the angles; this is not motion.
  if (phase_ == TeleopPhase::kCentring && !input.drives_obey) return;
  check_speeds();
  if (phase_ > TeleopPhase::kUnfolding && phase_ < TeleopPhase::kStopping) check_tip();
  if (phase_ > TeleopPhase::kUnfolding && phase_ < TeleopPhase::kStopping) check_workspace();
}

void Teleoperation::keep_in_range(ArmVector& position_rad) const noexcept {
  for (int i = 0; i < kArmJoints; ++i) {
    const JointRange& range = path_model_.ranges()[static_cast<std::size_t>(i)];
    position_rad[i] = std::clamp(position_rad[i], range.lower_rad, range.upper_rad);
  }
}

void Teleoperation::check_range(const ArmVector& position_rad) noexcept {
  for (int i = 0; i < kArmJoints; ++i) {
    const JointRange& range = path_model_.ranges()[static_cast<std::size_t>(i)];
    const double inside_rad = std::clamp(position_rad[i], range.lower_rad, range.upper_rad);
    // Negated so that NaN fails the check.
    if (std::abs(position_rad[i] - inside_rad) <= kBeyondStop_rad) continue;
    excess_ = {kFirstArmJoint + i, position_rad[i], inside_rad};
    return fail(TeleopEnd::kJointOutside);
  }
}

void Teleoperation::restart_speeds() noexcept {
  for (SpeedProof& proof : speed_proofs_) proof.restart();
}

void Teleoperation::prove_speeds(const TeleopInput& input) noexcept {
  if (input.robot_elapsed_s == 0.0) return;  // no new sample
  for (int i = 0; i < kFirstArmJoint; ++i)
    speed_proofs_[static_cast<std::size_t>(i)].update(input.wheel_position_rad[i], input.robot_taken);
  for (int i = 0; i < kArmJoints; ++i)
    speed_proofs_[static_cast<std::size_t>(kFirstArmJoint + i)].update(input.arm_position_rad[i],
                                                                       input.robot_taken);
}

void Teleoperation::check_speeds() noexcept {
  const WholeBodyController::State& state = robot_.state();
  for (int i = 0; i < kFirstArmJoint + kArmJoints; ++i) {
    const bool wheel = i < kFirstArmJoint;
    const double speed =
        wheel ? state.wheel_velocity_rad_per_s[i] : state.velocity[kBaseAxes + i - kFirstArmJoint];
    const double limit = wheel ? config_.wheel_speed_limit_rad_per_s : config_.joint_speed_limit_rad_per_s;
    if (!is_too_fast(speed, limit, speed_proofs_[static_cast<std::size_t>(i)])) continue;
    excess_ = {i, speed, limit};
    return fail(wheel ? TeleopEnd::kWheelTooFast : TeleopEnd::kJointTooFast);
  }
}

void Teleoperation::check_tip() noexcept {
  const TipPose at = tip();
  const TipSetpoint& setpoint = smoothing_.setpoint();
  const double off_m = (setpoint.p_WT_m - at.p_WT_m).norm();
  if (!(off_m <= config_.setpoint_distance_limit_m)) {
    excess_ = {-1, off_m, config_.setpoint_distance_limit_m};
    return stop(TeleopEnd::kSetpointTooFar);
  }
  // Beyond half a turn the spring would pull the other way round.
  const double off_rad = setpoint.q_WT.angularDistance(at.q_WT);
  if (off_rad <= config_.setpoint_turn_limit_rad) return;
  excess_ = {-1, off_rad, config_.setpoint_turn_limit_rad};
  stop(TeleopEnd::kSetpointTurnedTooFar);
}

void Teleoperation::check_workspace() noexcept {
  const WholeBodyController::State& state = robot_.state();
  const Eigen::Vector2d base_W_m(state.X_WB.x_m, state.X_WB.y_m);
  const double base_out_m = outside_m(config_.workspace.base_W_m, base_W_m);
  if (!(base_out_m <= Workspace::kMargin_m)) {
    excess_ = {-1, base_out_m, Workspace::kMargin_m};
    return stop(TeleopEnd::kBaseOutside);
  }
  // On the way to the start, the end effector may come from outside the workspace.
  if (phase_ == TeleopPhase::kApproaching) return;
  const double tip_out_m = outside_m(config_.workspace.tip_W_m, Eigen::Vector3d(state.X_WT.translation()));
  if (tip_out_m <= Workspace::kMargin_m) return;
  excess_ = {-1, tip_out_m, Workspace::kMargin_m};
  stop(TeleopEnd::kTipOutside);
}

bool Teleoperation::arm_is_behind(const ArmVector& position_rad) noexcept {
  int joint = 0;
  const double off_rad = (output_.arm_target - position_rad).cwiseAbs().maxCoeff(&joint);
  behind_s_ = off_rad <= config_.joint_following_error_rad ? 0.0 : behind_s_ + config_.period_s;
  if (behind_s_ < kFollowing_s) return false;
  excess_ = {kFirstArmJoint + joint, off_rad, config_.joint_following_error_rad};
  return true;
}

void Teleoperation::centre(const TeleopInput& input) noexcept {
  output_.wheel_torque_Nm = robot_.brake_base();
  grip_seen_ = grip_seen_ || input.grip_fresh;
  centring_share_ = config_.master_has_force ? 1.0 : 0.0;
  if (!input.drives_obey) {
    // Commutation and homing move the arm and change its angles.
    robot_.reset(input.wheel_position_rad, input.arm_position_rad);
    restart_speeds();
    hold_rad_ = input.arm_position_rad;
  }
  // Commutation and homing, also of the haptic device, do not count as the operator's time.
  if (!input.drives_obey || !input.master_ready) in_phase_s_ = 0;
  const bool centred = input.master_ready && grip_seen_ &&
                       input.grip.p_HD_m.norm() < config_.centred_within_m &&
                       input.grip.v_HD_H_m_per_s.norm() < config_.resting_speed_m_per_s;
  if (for_long(input.drives_obey && centred, kHold_s)) {
    unfold_from_rad_ = input.arm_position_rad;
    const double furthest_rad = (config_.unfolded_rad - unfold_from_rad_).cwiseAbs().maxCoeff();
    behind_s_ = 0;
    unfold_s_ = std::max({0.5, furthest_rad / config_.unfolding_speed_rad_per_s,
                          shortest_s(furthest_rad, config_.joint_setpoint)});
    enter(TeleopPhase::kUnfolding);
  } else if (in_phase_s_ > config_.centring_timeout_s) {
    stop(TeleopEnd::kNotCentred);
  }
}

void Teleoperation::unfold(const TeleopInput& input) noexcept {
  output_.wheel_torque_Nm = robot_.brake_base();
  const double share = least_jerk(in_phase_s_ / unfold_s_);
  output_.arm = TeleopOutput::Arm::kPosition;
  output_.arm_target = unfold_from_rad_ + share * (config_.unfolded_rad - unfold_from_rad_);
  const double off_rad = (config_.unfolded_rad - input.arm_position_rad).cwiseAbs().maxCoeff();
  if (for_long(share >= 1 && off_rad < config_.unfolded_within_rad, kHold_s)) {
    stiffness_ = config_.soft;
    arrived_ = false;
    approach_from_rad_ = input.arm_position_rad;
    smoothing_.reset(tip().p_WT_m, tip().q_WT);
    enter(TeleopPhase::kApproaching);
  } else if (arm_is_behind(input.arm_position_rad)) {
    stop(TeleopEnd::kJointBehind);
  } else if (in_phase_s_ > config_.unfolding_timeout_s) {
    stop(TeleopEnd::kNotUnfolded);
  }
}

void Teleoperation::approach(const TeleopInput& input) noexcept {
  // The path of the end effector follows from interpolating the joints between the two postures, so the arm
  // can reach it.
  const double share = least_jerk(in_phase_s_ / config_.approach_s);
  if (!arrived_) {
    const ArmVector posture_rad = approach_from_rad_ + share * (start_posture_rad_ - approach_from_rad_);
    path_model_.update((ChainVector() << robot_.state().position.head<kBaseAxes>(), posture_rad).finished());
    smoothing_.reset(path_model_.X_WT().translation(), Eigen::Quaterniond(path_model_.X_WT().linear()));
    robot_.set_posture(posture_rad);
  }
  const TipSetpoint& setpoint = smoothing_.setpoint();
  const TipPose at = tip();
  const bool near = (setpoint.p_WT_m - at.p_WT_m).norm() < config_.arrived_within_m &&
                    setpoint.q_WT.angularDistance(at.q_WT) < config_.arrived_within_rad;
  const double spring_N =
      keep(robot_.settle(setpoint, stiffness_, /*summing=*/share >= 1 && !near && !arrived_));
  const bool resting = robot_.state().tip_velocity_W.head<3>().norm() < config_.resting_speed_m_per_s &&
                       input.grip.v_HD_H_m_per_s.norm() < config_.resting_speed_m_per_s;
  if (in_phase_s_ > config_.approach_timeout_s) {
    stop(TeleopEnd::kNotArrived);
  } else if (!arrived_) {
    // Friction keeps the end effector slightly off. The set-point moves to it, because integrating to the
    // last millimetre would cause hunting.
    arrived_ = for_long(share >= 1 && near && resting, kHold_s);
    if (arrived_) {
      smoothing_.reset(at.p_WT_m, at.q_WT);
      robot_.set_posture(input.arm_position_rad);
      robot_.adopt_rest();
      condition_held_s_ = 0;
    }
  } else if (for_long(resting && input.grip_fresh, kHold_s)) {
    if (spring_N < config_.slack_N) {
      take_hold(input);
      presence_.reset();
      tank_.reset();
      enter(TeleopPhase::kStiffening);
    } else {
      // It crept on after its arrival, and stands where the spring still pulls.
      arrived_ = false;
      condition_held_s_ = 0;
    }
  }
}

void Teleoperation::operate(const TeleopInput& input) noexcept {
  const double period_s = config_.period_s;
  follow_tuning(input.grip);
  if (phase_ == TeleopPhase::kStiffening &&
      stiffness_.translation_N_per_m >= tuning_.stiff.translation_N_per_m &&
      stiffness_.rotation_Nm_per_rad >= tuning_.stiff.rotation_Nm_per_rad)
    enter(TeleopPhase::kOperating);

  const bool clutch = is_down(config_.clutch_button, input);
  if (clutched_ && !clutch) take_hold(input);
  clutched_ = clutch;
  if (clutched_) {
    feedback_share_ = 0;
  } else {
    feedback_share_ = approached(feedback_share_, tuning_.force_feedback && config_.master_has_force ? 1 : 0,
                                 period_s / config_.feedback_fade_s);
    // An old deflection may be none any more. The robot, not the operator, may have pushed the handle out. Do
    // not drive then.
    const bool may_drive = input.grip_fresh &&
                           (config_.mapping.rate_only || (config_.master_has_force && !tank_.nearly_empty()));
    mapping_.step(input.grip, tip(), may_drive, input.grip_fresh);
  }
  centring_share_ = std::max(0.0, centring_share_ - period_s / config_.feedback_fade_s);
  const Eigen::Vector3d target_W_m = held_in(config_.workspace.tip_W_m, mapping_.target().p_WT_m);
  output_.at_wall = target_W_m != mapping_.target().p_WT_m;
  smoothing_.step(target_W_m, mapping_.target().q_WT);
  output_.setpoint_limited = smoothing_.limited();
  keep(robot_.track(smoothing_.setpoint(), stiffness_));

  const Eigen::Vector3d& v_m_per_s = input.grip.v_HD_H_m_per_s;
  const bool felt = input.grip_after_pause
                        ? presence_.bridge(v_m_per_s)
                        : presence_.step(v_m_per_s, input.felt_H_N.value_or(input.held_H_N), withheld_N_);
  if (config_.detect_release && (!felt || input.released)) {
    feedback_share_ = centring_share_ = 0;
    clutched_ = false;
    button_was_up_ = false;
    // Drops the remaining way to the set-point: it is no longer wanted.
    mapping_.index(input.grip, smoothing_.setpoint());
    enter(TeleopPhase::kLetGo);
  }
}

void Teleoperation::follow_tuning(const Grip& grip) noexcept {
  const double period_s = config_.period_s;
  stiffness_.translation_N_per_m =
      approached(stiffness_.translation_N_per_m, tuning_.stiff.translation_N_per_m,
                 config_.stiffening_per_s.translation_N_per_m * period_s);
  stiffness_.rotation_Nm_per_rad =
      approached(stiffness_.rotation_Nm_per_rad, tuning_.stiff.rotation_Nm_per_rad,
                 config_.stiffening_per_s.rotation_Nm_per_rad * period_s);

  const double share = period_s / config_.feedback_fade_s;
  hand_force_gain_ =
      approached(hand_force_gain_, 1 / tuning_.force_scale, share / config_.feedback.force_scale);
  contact_share_ = approached(contact_share_, tuning_.contact_share, share);
  rate_speed_m_per_s_ =
      approached(rate_speed_m_per_s_, tuning_.rate_speed_m_per_s, share * config_.mapping.rate_speed_m_per_s);
  mapping_.set_rate_speed(rate_speed_m_per_s_);
  mapping_.set_motion_scale(tuning_.motion_scale, grip);
}

void Teleoperation::wait_for_hand(const TeleopInput& input) noexcept {
  const TipSetpoint& setpoint = smoothing_.setpoint();
  smoothing_.step(setpoint.p_WT_m, setpoint.q_WT);
  keep(robot_.track(smoothing_.setpoint(), stiffness_));
  const bool pressed = input.buttons != 0;
  if (!pressed) button_was_up_ = true;
  if (pressed && button_was_up_ && input.grip_fresh) {
    take_hold(input);
    presence_.reset();
    tank_.reset();
    gripper_blocked_ = true;
    enter(TeleopPhase::kOperating);
  }
}

void Teleoperation::take_hold(const TeleopInput& input) noexcept {
  mapping_.index(input.grip, smoothing_.setpoint());
  feedback_share_ = rim_share_ = 0;
}

void Teleoperation::come_to_rest() noexcept {
  output_.wheel_torque_Nm = robot_.brake_base();
  output_.arm_target = hold_rad_;
  const double fastest = robot_.state().wheel_velocity_rad_per_s.cwiseAbs().maxCoeff();
  if (for_long(fastest < kWheelRest_rad_per_s, kRestHold_s) || in_phase_s_ > config_.stop_timeout_s)
    enter(TeleopPhase::kLowering);
}

void Teleoperation::lower_arm() noexcept {
  const double share = std::min(1.0, in_phase_s_ / config_.lowering_s);
  output_.wheel_torque_Nm = robot_.brake_base();
  output_.arm = TeleopOutput::Arm::kTorque;
  output_.arm_target = robot_.lowering_torque_Nm(share);
  const double fastest = robot_.state().velocity.tail<kArmJoints>().cwiseAbs().maxCoeff();
  if (for_long(share >= 1 && fastest < kJointRest_rad_per_s, kHold_s) || in_phase_s_ > 3 * config_.lowering_s)
    enter(TeleopPhase::kOff);
}

double Teleoperation::keep(const WholeBodyController::Output& robot) noexcept {
  output_.arm = TeleopOutput::Arm::kTorque;
  output_.arm_target = robot.arm_torque_Nm;
  output_.wheel_torque_Nm = robot.wheel_torque_Nm;
  output_.wrench_W = robot.wrench_W;
  output_.spring_W_N = robot.spring_W_N;
  output_.limited = robot.limited;
  output_.protecting = robot.protecting;
  return robot.spring_W_N.norm();
}

void Teleoperation::command_master(const TeleopInput& input) noexcept {
  withheld_N_ = 0;
  output_.enable_master = phase_ >= TeleopPhase::kCentring && phase_ <= TeleopPhase::kLetGo;
  if (!output_.enable_master || !grip_seen_) return;
  const Grip& grip = input.grip;
  // Springs between the handle and a fixed point are passive; they need no tank.
  Eigen::Vector3d fixed_H_N =
      centring_share_ * config_.centring.force_N(Eigen::Vector3d::Zero(), grip.p_HD_m, grip.v_HD_H_m_per_s);
  const bool mapped = phase_ == TeleopPhase::kStiffening || phase_ == TeleopPhase::kOperating;
  if (mapped && config_.master_has_force && !config_.mapping.rate_only) {
    // Enable the boundary spring only once it is unloaded; otherwise it would inject energy.
    if (config_.mapping.boundary.inside(grip.p_HD_m)) rim_share_ = 1;
    fixed_H_N += rim_share_ * config_.mapping.boundary.rim_force_H_N(grip.p_HD_m);
  }
  output_.force_H_N = fixed_H_N;
  const Eigen::Vector3d held_fixed_H_N = fixed_before_H_N_;
  fixed_before_H_N_ = fixed_last_H_N_;
  fixed_last_H_N_ = fixed_H_N;
  if (!mapped) return;

  const double stretch_m = (smoothing_.setpoint().p_WT_m - robot_.state().X_WT.translation()).norm();
  const ForceFeedback feedback{.force_scale = 1 / hand_force_gain_,
                               .force_limit_N = config_.feedback.force_limit_N,
                               .contact_share = contact_share_};
  const Eigen::Vector3d felt_W_N = feedback.felt_W_N(output_.spring_W_N, robot_.state().contact_W_N);
  const double stored_J =
      feedback_share_ * feedback.stored_J(stretch_m, stiffness_.translation_N_per_m, tuning_.motion_scale);
  const EnergyTank::Output coupling =
      tank_.step(grip.p_HD_m, grip.v_HD_H_m_per_s, input.held_H_N - held_fixed_H_N,
                 feedback_share_ * feedback.force_H_N(felt_W_N), stored_J);
  output_.force_H_N += coupling.force_N;
  output_.withheld_N = withheld_N_ = coupling.withheld_N;
  output_.tank_J = tank_.level_J();
}

void Teleoperation::command_gripper(const TeleopInput& input) noexcept {
  if (phase_ != TeleopPhase::kStiffening && phase_ != TeleopPhase::kOperating) return;
  const bool down = is_down(config_.gripper_button, input);
  // The press that ends LetGo does not move the gripper.
  if (!down) gripper_blocked_ = false;
  output_.move_gripper = config_.gripper_button >= 0;
  output_.gripper_opening_m = down && !gripper_blocked_ ? config_.gripper_closed_m : config_.gripper_open_m;
}

bool Teleoperation::is_down(int button, const TeleopInput& input) noexcept {
  return button >= 0 && (input.buttons >> button & 1U) != 0;
}

TipPose Teleoperation::tip() const noexcept {
  return {robot_.state().X_WT.translation(), Eigen::Quaterniond(robot_.state().X_WT.linear())};
}

bool Teleoperation::for_long(bool condition, double duration_s) noexcept {
  condition_held_s_ = condition ? condition_held_s_ + config_.period_s : 0.0;
  return condition_held_s_ >= duration_s;
}

void Teleoperation::enter(TeleopPhase phase) noexcept {
  phase_ = phase;
  in_phase_s_ = condition_held_s_ = 0;
  hold_rad_ = robot_.state().position.tail<kArmJoints>();
}

void Teleoperation::stop(TeleopEnd end) noexcept {
  if (phase_ == TeleopPhase::kStopping || phase_ == TeleopPhase::kLowering) return;
  end_ = end;
  // Before unfolding, the arm lies as it was found and need not be lowered.
  enter(phase_ == TeleopPhase::kCentring ? TeleopPhase::kOff : TeleopPhase::kStopping);
}

void Teleoperation::fail(TeleopEnd end) noexcept {
  end_ = end;
  enter(TeleopPhase::kFaulted);
}

}  // namespace control
