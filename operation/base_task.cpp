#include "operation/base_task.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "hal/seconds.h"

namespace operation {
namespace {

using hal::seconds;
using runtime::Moment;
using runtime::StopReason;
using runtime::Verdict;
using std::chrono::nanoseconds;

// Reasons to stop, see StopReason::text.
constexpr const char* kNoSetpoint =
    "no new set-point for {value:.3f} s; braked and switched off: see what holds up their source";
constexpr const char* kTooFast =
    "{joint} turned at {value:.1f} rad/s, more than allowed (limits.wheel_speed_rad_per_s = {limit:g}); "
    "drives "
    "switched off";
constexpr const char* kTooFarBehind =
    "the base was {value:.3f} m from its reference, more than allowed (limits.following_error_m = "
    "{limit:g}); "
    "braked and switched off: see what holds it back, or raise limits.force_N and limits.moment_Nm";
constexpr const char* kTooFarTurned =
    "the base was turned {value:.3f} rad from its reference, more than allowed (limits.following_error_rad = "
    "{limit:g}); braked and switched off: see what holds it back, or raise limits.force_N and "
    "limits.moment_Nm";
constexpr const char* kOutsideWorkspace =
    "the base was {value:.3f} m outside [workspace], more than allowed ({limit:g}); braked and switched off: "
    "drive it back inside by velocity";

control::WheelVector wheel_positions(const hal::RobotSample& sample) noexcept {
  control::WheelVector position_rad;
  for (std::size_t i = 0; i < kWheels; ++i)
    position_rad[static_cast<Eigen::Index>(i)] = sample.joints[i].position_rad;
  return position_rad;
}

Eigen::Vector2d place_m(const control::PlanarPose& pose) noexcept { return {pose.x_m, pose.y_m}; }

/// A base that was pushed out of its workspace may drive back from there.
double allowed_outside_m(const BaseTask::Config& config) noexcept {
  constexpr double kMargin_m = control::Workspace::kMargin_m;
  const double at_start_m = control::outside_m(config.workspace.base_W_m, place_m(config.start));
  return at_start_m > kMargin_m ? at_start_m + kMargin_m : kMargin_m;
}

std::array<double, 3> as_array(const control::PlanarPose& pose) noexcept {
  return {pose.x_m, pose.y_m, pose.yaw_rad};
}

}  // namespace

BaseTask::BaseTask(const Config& config, const hal::Robot& robot, MotionSource& motion,
                   const control::PlanarPose* truth)
    : config_(config),
      motion_(motion),
      truth_(truth),
      controller_(config.controller),
      reference_limiter_(config.setpoint),
      sample_clock_(config.period),
      joints_(robot.joints().size()),
      X_WB_(config.start),
      may_be_outside_m_(allowed_outside_m(config)) {
  if (joints_ < kWheels || robot.joints().front().name.starts_with("arm"))
    throw std::invalid_argument(
        "the base needs a robot with four wheels, this one has " + std::to_string(joints_) +
        (joints_ == 1 ? " joint" : " joints") +
        (joints_ > 0 ? ", the first of which is " + robot.joints().front().name : ""));
  for (const hal::JointInfo& wheel : robot.joints().first(kWheels))
    if (config.controller.torque_limit_Nm > wheel.torque_limit_Nm)
      throw std::invalid_argument(
          "limits.wheel_torque_Nm = " + std::to_string(config.controller.torque_limit_Nm) +
          " is more than the " + std::to_string(wheel.torque_limit_Nm) + " N·m that " + wheel.name +
          " can deliver");
  record_.odometry_W = as_array(config.start);
  for (std::size_t i = 0; i < kWheels; ++i)
    torque_rates_[i] = control::TorqueRate(config.torque_rate_per_s * robot.joints()[i].torque_limit_Nm,
                                           seconds(config.period));
  speed_proofs_.fill(control::SpeedProof(config.wheel_speed_limit_rad_per_s));
}

void BaseTask::read(const Moment& moment) noexcept {
  const hal::RobotSample& sample = moment.sample;
  record_ = {};
  record_.time = moment.time;
  record_.phase = moment.phase;
  if (truth_ != nullptr) record_.truth_W = as_array(*truth_);
  for (std::size_t i = 0; i < kWheels; ++i) {
    record_.torque_command_Nm[i] = sample.enabled ? moment.sent.joints[i].target : 0.0;
    record_.torque_measured_Nm[i] = sample.joints[i].torque_Nm;
    record_.position_rad[i] = sample.joints[i].position_rad;
    record_.reported_velocity_rad_per_s[i] = sample.joints[i].velocity_rad_per_s;
  }
  position_rad_ = wheel_positions(sample);
  elapsed_s_ = sample_clock_.elapsed_s(sample.stamp);
  for (std::size_t i = 0; i < kWheels && elapsed_s_ > 0; ++i)
    speed_proofs_[i].update(sample.joints[i].position_rad, runtime::bounds_of(sample));
}

bool BaseTask::can_brake_after_pause(const Moment& /*moment*/) noexcept {
  // The reference has moved on meanwhile: do not chase it.
  controller_.forget_velocity(position_rad_);
  return true;
}

Verdict BaseTask::wait(const Moment& /*moment*/) noexcept {
  keep_record(controller_.observe(position_rad_, elapsed_s_));
  return {};
}

Verdict BaseTask::begin(const Moment& moment, hal::RobotCommand& /*command*/) noexcept {
  controller_.reset(position_rad_, X_WB_);
  for (control::SpeedProof& proof : speed_proofs_) proof.restart();
  obeyed_ = true;
  motion_.begin(moment.now, X_WB_);
  reference_limiter_.reset(X_WB_);
  followed_ = last_reference_ = moment.now;
  return {};
}

Verdict BaseTask::step(const Moment& moment, hal::RobotCommand& command) noexcept {
  const Motion motion = motion_.read(moment.now, X_WB_);
  const control::BaseReference reference = limit(motion.reference, moment.now);
  record_.reference_W = as_array(reference.X_WB);
  const nanoseconds age = moment.now - motion.stamp;
  StopReason reason;
  // A limited reference is still moving when its motion has ended.
  bool finished = false;
  if (age > config_.command_timeout)
    reason = {.kind = StopReason::Kind::kCommandTimeout, .text = kNoSetpoint, .value = seconds(age)};
  else if (motion.finished && !reference_limiter_.limited())
    finished = true;
  else if (reason = too_far(reference.X_WB, moment.now); !reason)
    reason = outside();
  Verdict verdict = reason || finished
                        ? Verdict{.next = Verdict::Next::kBrake, .reason = reason}
                        : apply(controller_.step(position_rad_, reference, elapsed_s_), true, command);
  if (reference_limiter_.limited()) record_.limited |= limiter::kSetpoint;
  if (motion.at_wall) record_.limited |= limiter::kWorkspace;
  return verdict;
}

control::BaseReference BaseTask::limit(const control::BaseReference& wanted_W, nanoseconds now) noexcept {
  const nanoseconds elapsed = now - std::exchange(last_reference_, now);
  return reference_limiter_.step(wanted_W, seconds(elapsed > nanoseconds(0) ? elapsed : config_.period),
                                 seconds(config_.period));
}

StopReason BaseTask::too_far(const control::PlanarPose& reference_W, nanoseconds now) noexcept {
  const double off_m = std::hypot(reference_W.x_m - X_WB_.x_m, reference_W.y_m - X_WB_.y_m);
  const double off_rad = std::abs(reference_W.yaw_rad - X_WB_.yaw_rad);
  const bool near = off_m <= config_.following_error_m;
  if (near && off_rad <= config_.following_error_rad) followed_ = now;
  if (now - followed_ <= kFollowingTime) return {};
  if (near)
    return {.kind = StopReason::Kind::kTurnedBehind,
            .text = kTooFarTurned,
            .value = off_rad,
            .limit = config_.following_error_rad};
  return {.kind = StopReason::Kind::kBehind,
          .text = kTooFarBehind,
          .value = off_m,
          .limit = config_.following_error_m};
}

StopReason BaseTask::outside() const noexcept {
  const double out_m = control::outside_m(config_.workspace.base_W_m, place_m(X_WB_));
  if (out_m <= may_be_outside_m_) return {};
  return {.kind = StopReason::Kind::kOutside,
          .text = kOutsideWorkspace,
          .value = out_m,
          .limit = may_be_outside_m_};
}

Verdict BaseTask::brake(const Moment& /*moment*/, hal::RobotCommand& command,
                        double& fastest_rad_per_s) noexcept {
  const std::uint8_t limited = record_.limited;
  const control::BaseController::Output output = controller_.brake(position_rad_, elapsed_s_);
  Verdict verdict = apply(output, false, command);
  record_.limited |= limited;
  fastest_rad_per_s = output.wheel_velocity_rad_per_s.cwiseAbs().maxCoeff();
  return verdict;
}

Verdict BaseTask::apply(const control::BaseController::Output& output, bool running,
                        hal::RobotCommand& command) noexcept {
  keep_record(output);
  for (std::size_t i = 0; i < kWheels; ++i) {
    const double wanted_Nm = output.torque_Nm[static_cast<Eigen::Index>(i)];
    control::TorqueRate& rate = torque_rates_[i];
    // Braking is not limited.
    command.joints[i] = hal::JointCommand::torque_Nm(running ? rate.step(wanted_Nm) : rate.pass(wanted_Nm));
    if (rate.limited()) record_.limited |= limiter::kTorqueRate;
  }
  // The arm is not controlled; without torque it would fall.
  for (std::size_t i = kWheels; i < joints_; ++i)
    command.joints[i] = hal::JointCommand::velocity_rad_per_s(0.0);
  for (std::size_t i = 0; i < kWheels; ++i)
    if (control::is_too_fast(record_.velocity_rad_per_s[i], config_.wheel_speed_limit_rad_per_s,
                             speed_proofs_[i]))
      return {.next = Verdict::Next::kFail,
              .reason = {.kind = StopReason::Kind::kOverspeed,
                         .text = kTooFast,
                         .joint = static_cast<int>(i),
                         .value = record_.velocity_rad_per_s[i],
                         .limit = config_.wheel_speed_limit_rad_per_s}};
  return {};
}

void BaseTask::keep_record(const control::BaseController::Output& output) noexcept {
  // The start is the pose after the drives' commutation, and remains so if they never obey.
  X_WB_ = obeyed_ ? output.X_WB : config_.start;
  record_.odometry_W = as_array(X_WB_);
  record_.limited = output.limited ? limiter::kEffort : 0;
  for (std::size_t i = 0; i < 3; ++i) record_.wrench_B[i] = output.wrench_B[static_cast<Eigen::Index>(i)];
  for (std::size_t i = 0; i < kWheels; ++i)
    record_.velocity_rad_per_s[i] = output.wheel_velocity_rad_per_s[static_cast<Eigen::Index>(i)];
  record_.friction_factor = output.friction_factor;
}

}  // namespace operation
