#include "operation/teleop_task.h"

#include <algorithm>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>

#include "hal/seconds.h"

namespace operation {
namespace {

using control::TeleopEnd;
using control::TeleopInput;
using control::TeleopOutput;
using control::TeleopPhase;
using runtime::Moment;
using runtime::Phase;
using runtime::StopReason;
using runtime::Verdict;
using std::chrono::nanoseconds;

constexpr std::size_t kJoints = TeleopRecord::kJoints;
/// Up to this many periods it was a late wake-up, and the next one is correspondingly early.
constexpr int kPeriodsOfNoPause = 3;
/// Relative to the controller's own times for braking and lowering, which it counts in cycles.
constexpr double kBrakeShare = 2;
constexpr double kDegrees = 180 / std::numbers::pi;

// Reasons to stop, see StopReason::text.
constexpr const char* kNotCentred =
    "the handle did not come to its origin in time; nothing has moved: enable again and bring it to its "
    "middle";
constexpr const char* kNotUnfolded =
    "the arm did not come to its unfolded pose in time; braked, arm lowered, switched off";
constexpr const char* kNotArrived =
    "the end effector did not come to rest in front of the robot in time; braked, arm lowered, switched off";
constexpr const char* kMasterFailed = "{master}; braked, arm lowered, switched off";
constexpr const char* kMasterFailedEarly = "{master}; nothing has moved";
constexpr const char* kNotHomed =
    "the arm does not know its angles; set ethercat.home_arms = true, which MOVES THE ARM when it is enabled";
constexpr const char* kWheelTooFast =
    "{joint} turned at {value:.1f} rad/s, more than allowed (limits.wheel_speed_rad_per_s = {limit:g}); "
    "drives "
    "switched off";
constexpr const char* kJointTooFast =
    "{joint} turned at {value:.1f} rad/s, more than allowed (teleoperation.arm.joint_speed_limit_rad_per_s = "
    "{limit:g}); drives switched off";
constexpr const char* kJointOutside =
    "{joint} read {value:.3f} rad, and its end stop is at {limit:.3f} rad: its encoder is wrong, or it was "
    "homed "
    "elsewhere; drives switched off";
constexpr const char* kTipOutside =
    "the end effector was {value:.3f} m outside [workspace], more than allowed ({limit:g}); braked, arm "
    "lowered, "
    "switched "
    "off: see what pushed it there; the next start brings it back";
constexpr const char* kBaseOutside =
    "the base was {value:.3f} m outside [workspace], more than allowed ({limit:g}); braked, arm lowered, "
    "switched "
    "off: push it back inside, or restart youbotd where its walls are to begin";
constexpr const char* kJointBehind =
    "{joint} was {value:.2f} rad from its set-point, more than allowed "
    "(teleoperation.arm.following_error_rad = "
    "{limit:g}): see what holds it back; braked, arm lowered, switched off";
constexpr const char* kSetpointTooFar =
    "the end effector was {value:.2f} m from its set-point, more than allowed "
    "(teleoperation.coupling.setpoint_distance_limit_m = {limit:g}); braked, arm lowered, switched off: see "
    "what "
    "holds it back";
constexpr const char* kSetpointTurnedTooFar =
    "the end effector was turned {value:.0f}° from its set-point, more than allowed "
    "(teleoperation.coupling.setpoint_turn_limit_deg = {limit:.0f}); braked, arm lowered, switched off: see "
    "what "
    "holds it back";

std::array<double, 3> numbers(const Eigen::Vector3d& v) noexcept { return {v.x(), v.y(), v.z()}; }
std::array<double, 4> numbers(const Eigen::Quaterniond& q) noexcept { return {q.w(), q.x(), q.y(), q.z()}; }

/// Empty unless the arm is under torque control.
std::optional<control::ArmVector> arm_torque_Nm(const hal::RobotCommand& command) noexcept {
  if (!command.enable) return std::nullopt;
  control::ArmVector torque_Nm;
  for (std::size_t i = kWheels; i < kJoints; ++i) {
    if (command.joints[i].mode != hal::CommandMode::kTorque) return std::nullopt;
    torque_Nm[static_cast<Eigen::Index>(i - kWheels)] = command.joints[i].target;
  }
  return torque_Nm;
}

bool is_over(Phase phase) noexcept { return phase == Phase::kOff || phase == Phase::kFaulted; }

}  // namespace

TeleopTask::TeleopTask(const Config& config, const hal::Robot& robot, hal::HapticDevice& master)
    : master_(master),
      control_(config.control),
      period_(std::chrono::round<nanoseconds>(std::chrono::duration<double>(config.control.period_s))),
      brake_timeout_(std::chrono::round<nanoseconds>(std::chrono::duration<double>(
          kBrakeShare * (config.control.stop_timeout_s + 3 * config.control.lowering_s)))),
      sample_clock_(period_),
      tuned_(control::Teleoperation::tuning_of(config.control)) {
  if (robot.joints().size() != kJoints)
    throw std::invalid_argument("teleoperation needs a base with one arm, " + std::to_string(kJoints) +
                                " joints; this robot has " + std::to_string(robot.joints().size()) +
                                ": set ethercat.kind = \"base+arm\", for a simulated robot, too");
  for (std::size_t i = 0; i < kJoints; ++i)
    torque_rates_[i] = control::TorqueRate(config.torque_rate_per_s * robot.joints()[i].torque_limit_Nm,
                                           config.control.period_s);
}

void TeleopTask::read(const Moment& moment) noexcept {
  // After a pause, the old command must not act.
  if (moment.paused || is_over(moment.phase)) master_command_ = {};
  master_status_ = master_.exchange(master_command_, master_sample_);
  controlled_ = false;

  const hal::RobotSample& sample = moment.sample;
  input_ = {};
  input_.drives_obey = sample.enabled;
  input_.robot_fault = !moment.status.ok();
  input_.robot_elapsed_s = sample_clock_.elapsed_s(sample.stamp);
  input_.robot_taken = runtime::bounds_of(sample);
  for (std::size_t i = 0; i < kWheels; ++i)
    input_.wheel_position_rad[static_cast<Eigen::Index>(i)] = sample.joints[i].position_rad;
  for (std::size_t i = kWheels; i < kJoints; ++i)
    input_.arm_position_rad[static_cast<Eigen::Index>(i - kWheels)] = sample.joints[i].position_rad;
  // The command of the last exchange acted until this sample.
  input_.arm_torque_Nm = acting_Nm_;
  acting_Nm_ = arm_torque_Nm(moment.sent);
  input_.arm_homed = std::all_of(sample.joints.begin() + kWheels, sample.joints.begin() + kJoints,
                                 [](const hal::JointSample& joint) { return joint.homed; });
  input_.master_ready = master_status_.ok();
  input_.grip_fresh = master_status_.ok() && master_status_.age < master_.info().fresh_within;
  // Not ready means not yet, and ends by itself.
  input_.master_fault = !master_status_.ok() && master_status_.fault != hal::HapticFault::kNotReady;
  input_.grip_after_pause = moment.gap > kPeriodsOfNoPause * period_;
  input_.grip = {master_sample_.p_HD_m, master_sample_.q_HD, master_sample_.v_HD_H_m_per_s};
  input_.buttons = master_sample_.buttons;
  // The command of the last exchange acted until this one.
  input_.held_H_N = held_H_N_;
  held_H_N_ = master_status_.f_D_H_N;
  input_.released = master_sample_.released;
  input_.felt_H_N = master_sample_.felt_f_D_H_N;
}

bool TeleopTask::can_brake_after_pause(const Moment& moment) noexcept {
  // Before the drives obey nothing moves, so there is nothing to stop.
  if (moment.phase != Phase::kStarting) control_.stop_after_gap(input_);
  return true;
}

Verdict TeleopTask::wait(const Moment& moment) noexcept {
  if (is_over(moment.phase)) {
    control_.switch_off();
  } else if (!started_) {
    started_ = true;
    control_.request_start();
  }
  control(moment);
  hal::RobotCommand once_they_obey;
  apply(once_they_obey);  // for the record
  return control_.finished() ? Verdict{.next = Verdict::Next::kFail, .reason = reason()} : Verdict{};
}

Verdict TeleopTask::begin(const Moment& moment, hal::RobotCommand& command) noexcept {
  return step(moment, command);
}

Verdict TeleopTask::step(const Moment& moment, hal::RobotCommand& command) noexcept {
  // Angles relative to the power-up position do not give the arm's pose.
  if (control_.phase() == TeleopPhase::kCentring && !input_.arm_homed)
    control_.request_stop(TeleopEnd::kNotHomed);
  control(moment);
  apply(command);
  if (control_.finished()) return {.next = Verdict::Next::kFail, .reason = reason()};
  if (control_.phase() == TeleopPhase::kStopping) return {.next = Verdict::Next::kBrake, .reason = reason()};
  return {};
}

Verdict TeleopTask::brake(const Moment& moment, hal::RobotCommand& command,
                          double& /*fastest_rad_per_s*/) noexcept {
  if (control_.end() == TeleopEnd::kNone) control_.request_stop();
  control(moment);
  apply(command);
  if (control_.phase() == TeleopPhase::kFaulted) return {.next = Verdict::Next::kFail, .reason = reason()};
  return {.next = control_.finished() ? Verdict::Next::kRest : Verdict::Next::kGoOn};
}

/// Once per cycle: a cycle that starts to brake has already been stepped.
void TeleopTask::control(const Moment& moment) noexcept {
  if (controlled_) return;
  controlled_ = true;
  if (tuning_.take(tuned_)) control_.tune(tuned_);
  output_ = control_.step(input_);
  master_command_.enable = output_.enable_master;
  master_command_.f_D_H_N = output_.force_H_N;
  keep_record(moment);
}

void TeleopTask::apply(hal::RobotCommand& command) noexcept {
  // Braking and lowering are not limited.
  const bool following = output_.phase >= TeleopPhase::kApproaching && output_.phase <= TeleopPhase::kLetGo;
  record_.limited &= static_cast<std::uint8_t>(~limiter::kTorqueRate);
  for (std::size_t i = 0; i < kWheels; ++i)
    command.joints[i] = hal::JointCommand::torque_Nm(
        torque_to_send(i, output_.wheel_torque_Nm[static_cast<Eigen::Index>(i)], following));
  for (std::size_t i = kWheels; i < kJoints; ++i) {
    const double target = output_.arm_target[static_cast<Eigen::Index>(i - kWheels)];
    hal::JointCommand& joint = command.joints[i];
    // The first torque replaces a position controller, whose torque is unknown.
    const bool had_torque = joint.mode == hal::CommandMode::kTorque;
    switch (output_.arm) {
      case TeleopOutput::Arm::kPosition: joint = hal::JointCommand::position_rad(target); break;
      case TeleopOutput::Arm::kTorque:
        joint = hal::JointCommand::torque_Nm(torque_to_send(i, target, following && had_torque));
        break;
    }
  }
  command.grippers[0] = {output_.move_gripper, output_.gripper_opening_m};
  for (std::size_t i = 0; i < kJoints; ++i) record_.command[i] = command.joints[i].target;
}

double TeleopTask::torque_to_send(std::size_t joint, double wanted_Nm, bool slowed) noexcept {
  control::TorqueRate& rate = torque_rates_[joint];
  const double torque_Nm = slowed ? rate.step(wanted_Nm) : rate.pass(wanted_Nm);
  if (rate.limited()) record_.limited |= limiter::kTorqueRate;
  return torque_Nm;
}

StopReason TeleopTask::reason() const noexcept {
  using Kind = StopReason::Kind;
  const control::TeleopExcess& excess = control_.excess();
  const auto beyond = [&excess](Kind kind, const char* text, double unit = 1) {
    return StopReason{.kind = kind,
                      .text = text,
                      .joint = excess.joint,
                      .value = excess.value * unit,
                      .limit = excess.limit * unit};
  };
  switch (control_.end()) {
    case TeleopEnd::kNone:
    case TeleopEnd::kRequested: return {};
    case TeleopEnd::kNotCentred: return {.kind = Kind::kNotInTime, .text = kNotCentred};
    case TeleopEnd::kNotUnfolded: return {.kind = Kind::kNotInTime, .text = kNotUnfolded};
    case TeleopEnd::kNotArrived: return {.kind = Kind::kNotInTime, .text = kNotArrived};
    case TeleopEnd::kMasterFault:
      // Only before the arm unfolds it ends at once.
      return {.kind = Kind::kMasterFault,
              .text = control_.finished() ? kMasterFailedEarly : kMasterFailed,
              .master = master_status_};
    case TeleopEnd::kStalled: return {.kind = Kind::kStalled};
    case TeleopEnd::kNotHomed: return {.kind = Kind::kMisfit, .text = kNotHomed};
    case TeleopEnd::kRobotFault: return {.kind = Kind::kNotObeying};
    case TeleopEnd::kWheelTooFast: return beyond(Kind::kOverspeed, kWheelTooFast);
    case TeleopEnd::kJointTooFast: return beyond(Kind::kOverspeed, kJointTooFast);
    case TeleopEnd::kJointOutside: return beyond(Kind::kOutside, kJointOutside);
    case TeleopEnd::kSetpointTooFar: return beyond(Kind::kBehind, kSetpointTooFar);
    case TeleopEnd::kSetpointTurnedTooFar:
      return beyond(Kind::kTurnedBehind, kSetpointTurnedTooFar, kDegrees);
    case TeleopEnd::kTipOutside: return beyond(Kind::kOutside, kTipOutside);
    case TeleopEnd::kBaseOutside: return beyond(Kind::kOutside, kBaseOutside);
    case TeleopEnd::kJointBehind: return beyond(Kind::kBehind, kJointBehind);
  }
  return {};
}

void TeleopTask::keep_record(const Moment& moment) noexcept {
  const control::WholeBodyController::State& robot = control_.robot();
  record_ = {};
  record_.time = moment.time;
  record_.phase = output_.phase;
  record_.rate_control = output_.mode == control::HapticMapping::Mode::kRate;
  record_.clutched = output_.clutched;
  record_.limited = output_.limited ? limiter::kEffort : 0;
  if (output_.setpoint_limited) record_.limited |= limiter::kSetpoint;
  if (output_.at_wall) record_.limited |= limiter::kWorkspace;
  record_.protecting = output_.protecting;
  record_.setpoint_p_WT_m = numbers(output_.setpoint.p_WT_m);
  record_.setpoint_q_WT = numbers(output_.setpoint.q_WT);
  record_.tip_p_WT_m = numbers(Eigen::Vector3d(robot.X_WT.translation()));
  record_.tip_q_WT = numbers(Eigen::Quaterniond(robot.X_WT.linear()));
  record_.contact_estimate_W_N = numbers(robot.contact_W_N);
  record_.base_W = {robot.X_WB.x_m, robot.X_WB.y_m, robot.X_WB.yaw_rad};
  record_.stiffness_N_per_m = output_.stiffness.translation_N_per_m;
  record_.force_scale = tuned_.force_scale;
  record_.motion_scale = tuned_.motion_scale;
  record_.spring_W_N = numbers(output_.spring_W_N);
  for (std::size_t i = 0; i < 6; ++i) record_.wrench_W[i] = output_.wrench_W[static_cast<Eigen::Index>(i)];
  record_.grip_p_HD_m = numbers(input_.grip.p_HD_m);
  record_.grip_q_HD = numbers(input_.grip.q_HD);
  record_.grip_v_HD_m_per_s = numbers(input_.grip.v_HD_H_m_per_s);
  record_.grip_force_H_N = numbers(output_.force_H_N);
  record_.held_force_H_N = numbers(input_.held_H_N);
  record_.grip_age_s = std::chrono::duration<double>(master_status_.age).count();
  record_.buttons = input_.buttons;
  record_.tank_J = output_.tank_J;
  record_.withheld_N = output_.withheld_N;
  energy_.update(input_.grip.p_HD_m, held_H_N_);
  record_.port_energy_J = energy_.energy_J();
  if (output_.move_gripper) record_.gripper_opening_m = output_.gripper_opening_m;
  record_.arm_mode = static_cast<std::uint8_t>(output_.arm);
  for (std::size_t i = 0; i < kJoints; ++i) {
    record_.position_rad[i] = moment.sample.joints[i].position_rad;
    record_.torque_measured_Nm[i] = moment.sample.joints[i].torque_Nm;
  }
}

}  // namespace operation
