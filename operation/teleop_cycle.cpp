#include "operation/teleop_cycle.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <numbers>
#include <stdexcept>

#include "runtime/stop_hints.h"

namespace operation {
namespace {

using control::TeleopEnd;
using control::TeleopInput;
using control::TeleopOutput;
using control::TeleopPhase;
using std::chrono::nanoseconds;

constexpr std::size_t kJoints = TeleopRecord::kJoints;
/// Cycles with the drives off before the loop ends, so that every drive has heard it.
constexpr std::chrono::milliseconds kOffHold{20};
/// A master's own thread does not keep step with this loop.
constexpr std::chrono::milliseconds kFresh{10};
/// After up to so many periods a wake-up was late, and the next is the earlier.
constexpr int kPeriodsOfNoPause = 3;
constexpr const char* kLowered = "; braked, arm lowered, switched off";
constexpr double kDegrees = 180 / std::numbers::pi;

std::array<double, 3> numbers(const Eigen::Vector3d& v) noexcept { return {v.x(), v.y(), v.z()}; }
std::array<double, 4> numbers(const Eigen::Quaterniond& q) noexcept { return {q.w(), q.x(), q.y(), q.z()}; }

}  // namespace

TeleopCycle::TeleopCycle(const Config& config, hal::Robot& robot, hal::HapticDevice& master)
    : config_(config),
      robot_(robot, control::PlausibilityMonitor::Wheels::kRolling, config.checks_off),
      master_(master),
      control_(config.control),
      period_(std::chrono::round<nanoseconds>(std::chrono::duration<double>(config.control.period_s))),
      sample_clock_(period_) {
  if (robot.joints().size() != kJoints)
    throw std::invalid_argument("teleoperation needs a base with one arm, " + std::to_string(kJoints) +
                                " joints; this robot has " + std::to_string(robot.joints().size()) +
                                ": set ethercat.kind = \"base+arm\"");
  for (std::size_t i = 0; i < kJoints; ++i)
    torque_rates_[i] = control::TorqueRate(config.torque_rate_per_s * robot.joints()[i].torque_limit_Nm,
                                           config.control.period_s);
}

void TeleopCycle::step(nanoseconds now) noexcept {
  if (!started_) first_ = now_ = now;
  const nanoseconds gap = now - now_;
  now_ = now;

  // Stopped by a debugger or starved: what was computed before is not to act now.
  const bool stalled = gap > config_.stall_timeout;
  if (stalled) {
    pause_.note(now, gap);
    for (std::size_t i = 0; i < kJoints; ++i)
      robot_command_.joints[i] =
          i < kWheels ? hal::JointCommand{} : hal::JointCommand::velocity_rad_per_s(0.0);
    master_command_.enable = false;
  }
  robot_status_ = robot_.exchange(robot_command_, robot_sample_);
  master_status_ = master_.exchange(master_command_, master_sample_);

  TeleopInput input;
  input.drives_obey = robot_sample_.enabled;
  input.robot_fault = !robot_status_.ok();
  input.robot_elapsed_s = sample_clock_.elapsed_s(robot_sample_.stamp);
  input.robot_taken = runtime::bounds_of(robot_sample_);
  for (std::size_t i = 0; i < kWheels; ++i)
    input.wheel_position_rad[static_cast<Eigen::Index>(i)] = robot_sample_.joints[i].position_rad;
  for (std::size_t i = kWheels; i < kJoints; ++i)
    input.arm_position_rad[static_cast<Eigen::Index>(i - kWheels)] = robot_sample_.joints[i].position_rad;
  input.arm_homed =
      std::all_of(robot_sample_.joints.begin() + kWheels, robot_sample_.joints.begin() + kJoints,
                  [](const hal::JointSample& joint) { return joint.homed; });
  input.master_ready = master_status_.ok();
  input.grip_fresh = master_status_.ok() && master_status_.age < kFresh;
  // Not ready is not yet, and ends by itself.
  input.master_fault = !master_status_.ok() && master_status_.fault != hal::HapticFault::kNotReady;
  input.grip_after_pause = gap > kPeriodsOfNoPause * period_;
  input.grip = {master_sample_.p_HD_m, master_sample_.q_HD, master_sample_.v_HD_H_m_per_s};
  input.buttons = master_sample_.buttons;
  // The command of the last exchange acted until this one.
  input.held_H_N = held_H_N_;
  held_H_N_ = master_status_.f_D_H_N;

  if (!started_) {
    started_ = true;
    if (stop_before_start_)
      end_early();
    else
      control_.request_start();
  }
  if (stalled) control_.stop_after_gap(input);
  const bool centring = control_.phase() == TeleopPhase::kCentring;
  if (centring && !input.drives_obey && now - first_ > config_.enable_timeout)
    control_.request_stop(TeleopEnd::kNotEnabled);
  // Angles that count from where the arm was at power-up tell nothing about where it is.
  if (centring && input.drives_obey && !input.arm_homed) control_.request_stop(TeleopEnd::kNotHomed);

  const TeleopOutput& output = control_.step(input);
  command_robot(output);
  master_command_.enable = output.enable_master;
  master_command_.f_D_H_N = output.force_H_N;
  note_end();
  keep_record(input, output);
}

void TeleopCycle::command_robot(const TeleopOutput& output) noexcept {
  robot_command_.enable = output.enable_drives;
  torque_rate_limited_ = false;
  // Braking and lowering are not slowed down.
  const bool following = output.phase >= TeleopPhase::kApproaching && output.phase <= TeleopPhase::kLetGo;
  for (std::size_t i = 0; i < kWheels; ++i)
    robot_command_.joints[i] = hal::JointCommand::torque_Nm(
        torque_to_send(i, output.wheel_torque_Nm[static_cast<Eigen::Index>(i)], following));
  for (std::size_t i = kWheels; i < kJoints; ++i) {
    const double target = output.arm_target[static_cast<Eigen::Index>(i - kWheels)];
    hal::JointCommand& joint = robot_command_.joints[i];
    // The first torque takes over from a position controller, whose torque it does not know.
    const bool had_torque = joint.mode == hal::CommandMode::kTorque;
    switch (output.arm) {
      case TeleopOutput::Arm::kPosition: joint = hal::JointCommand::position_rad(target); break;
      case TeleopOutput::Arm::kTorque:
        joint = hal::JointCommand::torque_Nm(torque_to_send(i, target, following && had_torque));
        break;
    }
  }
  robot_command_.grippers[0] = {output.move_gripper, output.gripper_opening_m};
}

double TeleopCycle::torque_to_send(std::size_t joint, double wanted_Nm, bool slowed) noexcept {
  control::TorqueRate& rate = torque_rates_[joint];
  const double torque_Nm = slowed ? rate.step(wanted_Nm) : rate.pass(wanted_Nm);
  torque_rate_limited_ = torque_rate_limited_ || rate.limited();
  return torque_Nm;
}

void TeleopCycle::request_stop() noexcept {
  stop_before_start_ = !started_;
  control_.request_stop();
}

void TeleopCycle::switch_off() noexcept {
  stop_before_start_ = !started_;
  control_.switch_off();
  robot_command_ = {};
  master_command_ = {};
}

void TeleopCycle::end_early() noexcept {
  end_.end = TeleopEnd::kRequested;
  off_ = true;
  off_since_ = now_;
}

bool TeleopCycle::finished() const noexcept { return off_ && now_ - off_since_ >= kOffHold; }

void TeleopCycle::note_end() noexcept {
  if (control_.end() != TeleopEnd::kNone && control_.end() != end_.end) {
    end_.end = control_.end();
    end_.excess = control_.excess();
    end_.robot = robot_status_;
    end_.master = master_status_;
    end_.time = now_ - first_;
    end_.pause = pause_.before(now_);
  }
  if (control_.finished() && !off_) {
    off_ = true;
    off_since_ = now_;
  }
}

void TeleopCycle::keep_record(const TeleopInput& input, const TeleopOutput& output) noexcept {
  const control::WholeBodyController::State& robot = control_.robot();
  record_ = {};
  record_.time = now_ - first_;
  record_.phase = output.phase;
  record_.rate_control = output.mode == control::HapticMapping::Mode::kRate;
  record_.clutched = output.clutched;
  record_.limited = output.limited ? limiter::kEffort : 0;
  if (output.setpoint_limited) record_.limited |= limiter::kSetpoint;
  if (output.at_wall) record_.limited |= limiter::kWorkspace;
  if (torque_rate_limited_) record_.limited |= limiter::kTorqueRate;
  record_.protecting = output.protecting;
  record_.setpoint_p_WT_m = numbers(output.setpoint.p_WT_m);
  record_.setpoint_q_WT = numbers(output.setpoint.q_WT);
  record_.tip_p_WT_m = numbers(Eigen::Vector3d(robot.X_WT.translation()));
  record_.tip_q_WT = numbers(Eigen::Quaterniond(robot.X_WT.linear()));
  record_.base_W = {robot.X_WB.x_m, robot.X_WB.y_m, robot.X_WB.yaw_rad};
  record_.stiffness_N_per_m = output.stiffness.translation_N_per_m;
  record_.spring_W_N = numbers(output.spring_W_N);
  for (std::size_t i = 0; i < 6; ++i) record_.wrench_W[i] = output.wrench_W[static_cast<Eigen::Index>(i)];
  record_.grip_p_HD_m = numbers(input.grip.p_HD_m);
  record_.grip_q_HD = numbers(input.grip.q_HD);
  record_.grip_v_HD_m_per_s = numbers(input.grip.v_HD_H_m_per_s);
  record_.grip_force_H_N = numbers(output.force_H_N);
  record_.held_force_H_N = numbers(input.held_H_N);
  record_.grip_age_s = std::chrono::duration<double>(master_status_.age).count();
  record_.buttons = input.buttons;
  record_.tank_J = output.tank_J;
  record_.withheld_N = output.withheld_N;
  energy_.update(input.grip.p_HD_m, held_H_N_);
  record_.port_energy_J = energy_.energy_J();
  if (output.move_gripper) record_.gripper_opening_m = output.gripper_opening_m;
  record_.arm_mode = static_cast<std::uint8_t>(output.arm);
  for (std::size_t i = 0; i < kJoints; ++i) {
    record_.command[i] = robot_command_.joints[i].target;
    record_.position_rad[i] = robot_sample_.joints[i].position_rad;
    record_.torque_measured_Nm[i] = robot_sample_.joints[i].torque_Nm;
  }
}

void TeleopCycle::tell_truth(const TeleopTruth& truth) noexcept {
  record_.true_tip_p_WT_m = numbers(truth.p_WT_m);
  record_.contact_force_W_N = numbers(truth.contact_force_W_N);
}

std::string describe(const TeleopCycle::End& end, const hal::Robot& robot, const hal::HapticDevice& master) {
  const std::string when = fmt::format("{:.3f} s: ", std::chrono::duration<double>(end.time).count());
  const auto joint_name = [&] { return robot.joints()[static_cast<std::size_t>(end.excess.joint)].name; };
  switch (end.end) {
    case TeleopEnd::kRobotFault: {
      const hal::CycleStatus& status = end.robot;
      const std::string joint =
          status.joint >= 0 ? robot.joints()[static_cast<std::size_t>(status.joint)].name : "the robot";
      return when + runtime::then(end.pause) + joint + ": " +
             (status.ok() ? "its drives went off" : robot.explain(status)) + "; drives switched off";
    }
    case TeleopEnd::kMasterFault:
      return when + runtime::then(end.pause) + master.info().name + ": " + master.describe(end.master) +
             kLowered;
    case TeleopEnd::kNotEnabled: return when + control::describe(end.end) + runtime::kNotEnabledHint;
    case TeleopEnd::kStalled: return when + control::describe(end.end) + kLowered + runtime::kStalledHint;
    case TeleopEnd::kNotHomed:
      return when + control::describe(end.end) +
             "; set ethercat.home_arms = true, which MOVES THE ARM when it is enabled";
    case TeleopEnd::kNotCentred:
      return when + control::describe(end.end) +
             "; nothing has moved: enable again and bring it to its middle";
    case TeleopEnd::kWheelTooFast:
    case TeleopEnd::kJointTooFast:
      return when + fmt::format(
                        "{} turned at {:.1f} rad/s, more than allowed ({} = {:g}); drives switched off",
                        joint_name(), end.excess.value,
                        end.end == TeleopEnd::kWheelTooFast ? "limits.wheel_speed_rad_per_s"
                                                            : "teleoperation.arm.joint_speed_limit_rad_per_s",
                        end.excess.limit);
    case TeleopEnd::kJointOutside:
      return when +
             fmt::format(
                 "{} read {:.3f} rad, and its end stop is at {:.3f} rad: its encoder is wrong, or it was "
                 "homed elsewhere; drives switched off",
                 joint_name(), end.excess.value, end.excess.limit);
    case TeleopEnd::kTipOutside:
      return when +
             fmt::format(
                 "the tip was {:.3f} m outside [workspace], more than allowed ({:g}){}: see what pushed "
                 "it there; the next start brings it back",
                 end.excess.value, end.excess.limit, kLowered);
    case TeleopEnd::kBaseOutside:
      return when + fmt::format(
                        "the base was {:.3f} m outside [workspace], more than allowed ({:g}){}: push it back "
                        "inside, or restart youbotd where its walls are to begin",
                        end.excess.value, end.excess.limit, kLowered);
    case TeleopEnd::kJointBehind:
      return when + fmt::format(
                        "{} was {:.2f} rad from its set-point, more than allowed "
                        "(teleoperation.arm.following_error_rad = {:g}): see what holds it back{}",
                        joint_name(), end.excess.value, end.excess.limit, kLowered);
    case TeleopEnd::kSetpointTooFar:
      return when + fmt::format(
                        "the tip was {:.2f} m from its set-point, more than allowed "
                        "(teleoperation.coupling.setpoint_distance_limit_m = {:g}){}: see what holds it back",
                        end.excess.value, end.excess.limit, kLowered);
    case TeleopEnd::kSetpointTurnedTooFar:
      return when + fmt::format(
                        "the tip was turned {:.0f}° from its set-point, more than allowed "
                        "(teleoperation.coupling.setpoint_turn_limit_deg = {:.0f}){}: see what holds it back",
                        end.excess.value * kDegrees, end.excess.limit * kDegrees, kLowered);
    default: return when + control::describe(end.end) + kLowered;
  }
}

}  // namespace operation
