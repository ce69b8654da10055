#include "apps/youbot_bench/experiment_task.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "hal/seconds.h"

namespace youbot_bench {
namespace {

using hal::seconds;
using identification::experiments::gently;
using runtime::Moment;
using runtime::StopReason;
using runtime::Verdict;

using std::chrono::nanoseconds;

/// Speed and tolerances for moving a joint to its start position.
constexpr double kPlacing_rad_per_s = 0.2;
constexpr double kPlacingGain_per_s = 2.0;
constexpr double kPlaced_rad = 0.005;
constexpr std::chrono::seconds kPlacingTimeout{60};
/// Times its speed limit: maximum commanded speed of a joint with end stops.
constexpr double kOvershoot = 1.1;

// Reasons to stop, see StopReason::text.
constexpr const char* kTooFast =
    "{joint} turned at {value:.2f} rad/s, more than --max-speed; drives switched off";
constexpr const char* kTooFastForAnArm =
    "{joint} turned at {value:.2f} rad/s, more than --max-speed or its limit of {limit:.3g} rad/s; drives "
    "switched off";
constexpr const char* kMovedTooFar =
    "{joint} moved by {value:.3f} rad in this measurement, more than --max-travel; drives switched off";
constexpr const char* kWouldMoveTooFar =
    "{joint} moved by {value:.3f} rad in this measurement and would go on beyond --max-travel; drives "
    "switched "
    "off";
constexpr const char* kCameNearStop =
    "{joint} came near the end of its range, at {value:.3f} rad; drives switched off";
constexpr const char* kTookTooMuch =
    "{joint} took {value:.2f} N·m, more than the {limit:.3g} N·m it is made for; drives switched off";
constexpr const char* kIsBlocked =
    "{joint} is blocked: it took {value:.2f} N·m and did not turn; drives switched off";
constexpr const char* kNotAtItsPlace =
    "{joint} did not reach --start in time; it is at {value:.3f} rad; drives switched off";
constexpr const char* kDoesNotFit = "the experiment does not fit {joint}";

double target(const hal::JointCommand& command, hal::CommandMode mode) noexcept {
  return command.mode == mode ? command.target : 0.0;
}

}  // namespace

ExperimentTask::ExperimentTask(const Config& config, const hal::Robot& robot, std::vector<Joint> joints,
                               ExperimentRecording& recording)
    : config_(config),
      joints_(robot.joints()),
      recording_(recording),
      measurement_count_(joints.front().experiment->measurement_count()),
      measurement_(config.first_measurement) {
  const control::StateVariableFilter filter(
      {.cutoff_rad_per_s = config.filter_cutoff_rad_per_s, .period_s = seconds(config.period)});
  for (Joint& joint : joints) {
    const hal::JointInfo& info = joints_[joint.index];
    double max_speed_rad_per_s = config.max_speed_rad_per_s;
    if (joint.fit)
      max_speed_rad_per_s = std::min(max_speed_rad_per_s, kOvershoot * info.speed_limit_rad_per_s);
    has_end_stops_ = has_end_stops_ || joint.fit;
    channels_.push_back({.joint = std::move(joint),
                         .filter = filter,
                         .guard = JointGuard(info, seconds(config.period)),
                         .max_speed_rad_per_s = max_speed_rad_per_s});
  }
}

void ExperimentTask::read(const Moment& moment) noexcept {
  if (moves(moment.phase)) sense(moment);
}

void ExperimentTask::sense(const Moment& moment) noexcept {
  reading_time_s_ = seconds(moment.now - measurement_begin_);
  for (Channel& channel : channels_) {
    const hal::JointSample& joint = moment.sample.joints[channel.joint.index];
    channel.reading.time_s = reading_time_s_;
    channel.reading.position_rad = joint.position_rad;
    channel.reading.velocity_rad_per_s = channel.filter.step(joint.position_rad).velocity;
    channel.reading.torque_Nm = joint.torque_Nm;
    channel.torque_sum_Nm += joint.torque_Nm;
  }
}

Verdict ExperimentTask::begin(const Moment& moment, hal::RobotCommand& command) noexcept {
  if (!fits(moment.sample))
    return {.next = Verdict::Next::kFail,
            .reason = {.kind = StopReason::Kind::kMisfit,
                       .text = kDoesNotFit,
                       .joint = static_cast<int>(misfit_of_->joint.index)}};
  for (Channel& channel : channels_) {
    const hal::JointSample& joint = moment.sample.joints[channel.joint.index];
    channel.filter.reset(joint.position_rad);
    channel.start_rad = channel.joint.fit ? channel.joint.fit->start_rad(joint) : joint.position_rad;
  }
  placing_since_ = moment.now;
  sense(moment);
  return place(moment, command);
}

bool ExperimentTask::fits(const hal::RobotSample& sample) noexcept {
  for (Channel& channel : channels_) {
    if (!channel.joint.fit) continue;
    misfit_ = channel.joint.fit->check(sample);
    misfit_of_ = &channel;
    if (misfit_) return false;
  }
  return true;
}

std::string ExperimentTask::misfit() const {
  return misfit_ ? misfit_of_->joint.fit->describe(misfit_, joints_) : std::string();
}

Verdict ExperimentTask::step(const Moment& moment, hal::RobotCommand& command) noexcept {
  return measuring_ ? measure(moment, command) : place(moment, command);
}

/// Until each joint rests at the start of its experiment.
Verdict ExperimentTask::place(const Moment& moment, hal::RobotCommand& command) noexcept {
  bool all_there = true;
  for (Channel& channel : channels_) {
    const double left_rad = channel.start_rad - channel.reading.position_rad;
    if (!channel.joint.fit || (std::abs(left_rad) < kPlaced_rad &&
                               std::abs(channel.reading.velocity_rad_per_s) < config_.rest_rad_per_s))
      continue;
    all_there = false;
    if (moment.now - placing_since_ > kPlacingTimeout)
      return stop({.kind = StopReason::Kind::kNotPlaced,
                   .text = kNotAtItsPlace,
                   .joint = static_cast<int>(channel.joint.index),
                   .value = channel.reading.position_rad});
    if (const StopReason reason = watch(channel, moment.sent)) return stop(reason);
    const double wanted = std::clamp(kPlacingGain_per_s * left_rad, -kPlacing_rad_per_s, kPlacing_rad_per_s);
    command.joints[channel.joint.index] =
        bounded(channel, hal::JointCommand::velocity_rad_per_s(wanted), moment.sent);
  }
  if (all_there) begin_measuring(moment.now);
  return {};
}

void ExperimentTask::begin_measuring(nanoseconds now) noexcept {
  measuring_ = true;
  measuring_since_ = now;
  for (Channel& channel : channels_) channel.torque_sum_Nm = 0.0;
  begin_measurement(now);
}

void ExperimentTask::begin_measurement(nanoseconds now) noexcept {
  measurement_begin_ = now;
  reading_time_s_ = 0.0;
  for (Channel& channel : channels_) {
    channel.reading.time_s = 0.0;
    channel.origin_rad = channel.reading.position_rad;
    channel.joint.experiment->begin(measurement_, channel.reading);
  }
}

Verdict ExperimentTask::measure(const Moment& moment, hal::RobotCommand& command) noexcept {
  if (++cycles_since_row_ >= config_.cycles_per_row) record_row(moment);
  for (Channel& channel : channels_)
    if (const StopReason reason = watch(channel, moment.sent)) return stop(reason);

  bool all_finished = true;
  for (Channel& channel : channels_) {
    const identification::experiments::SetPoint set_point = channel.joint.experiment->step(channel.reading);
    command.joints[channel.joint.index] = bounded(channel, set_point.command, moment.sent);
    channel.position_command_rad = set_point.position_command_rad;
    // Command answered by the next values: the values of an exchange belong to the previous command.
    const hal::JointCommand& sent = moment.sent.joints[channel.joint.index];
    channel.reading.command_Nm =
        sent.mode == hal::CommandMode::kTorque ? sent.target : identification::experiments::kUnknown;
    all_finished = all_finished && channel.joint.experiment->finished();
  }
  if (!all_finished) return {};
  record_results(moment.now);
  if (++measurement_ == measurement_count_) return {.next = Verdict::Next::kBrake};
  begin_measurement(moment.now);
  return {};
}

/// Fault in its motion, if any.
StopReason ExperimentTask::watch(Channel& channel, const hal::RobotCommand& sent) noexcept {
  const identification::experiments::Reading& reading = channel.reading;
  const hal::JointInfo& info = joints_[channel.joint.index];
  const int joint = static_cast<int>(channel.joint.index);
  if (std::abs(reading.velocity_rad_per_s) > channel.max_speed_rad_per_s)
    return {.kind = StopReason::Kind::kOverspeed,
            .text = info.range.limited() ? kTooFastForAnArm : kTooFast,
            .joint = joint,
            .value = reading.velocity_rad_per_s,
            .limit = info.speed_limit_rad_per_s};
  if (goes_too_far(channel))
    return {.kind = StopReason::Kind::kTooFar,
            .text = info.range.limited() ? kWouldMoveTooFar : kMovedTooFar,
            .joint = joint,
            .value = reading.position_rad - channel.origin_rad};
  const JointGuard::Trip trip = channel.guard.watch(reading, sent.joints[channel.joint.index]);
  const double torque_Nm = channel.guard.torque_Nm();
  switch (trip) {
    case JointGuard::Trip::kNone: break;
    case JointGuard::Trip::kNearStop:
      return {.kind = StopReason::Kind::kNearStop,
              .text = kCameNearStop,
              .joint = joint,
              .value = reading.position_rad};
    case JointGuard::Trip::kTorque:
      return {.kind = StopReason::Kind::kTorque,
              .text = kTookTooMuch,
              .joint = joint,
              .value = torque_Nm,
              .limit = info.rated_torque_Nm};
    case JointGuard::Trip::kBlocked:
      return {.kind = StopReason::Kind::kBlocked, .text = kIsBlocked, .joint = joint, .value = torque_Nm};
  }
  return {};
}

Verdict ExperimentTask::stop(const StopReason& reason) noexcept {
  pressed_ = reason.kind == StopReason::Kind::kTorque || reason.kind == StopReason::Kind::kBlocked;
  return {.next = has_end_stops_ ? Verdict::Next::kBrake : Verdict::Next::kFail, .reason = reason};
}

/// A joint with end stops is stopped in time, before it has gone too far.
bool ExperimentTask::goes_too_far(const Channel& channel) const noexcept {
  if (!measuring_ || config_.max_travel_rad <= 0) return false;
  const double velocity = channel.reading.velocity_rad_per_s;
  double travel_rad = channel.reading.position_rad - channel.origin_rad;
  if (channel.joint.fit)
    travel_rad +=
        std::copysign(identification::experiments::stopping_distance_rad(std::abs(velocity)), velocity);
  return std::abs(travel_rad) > config_.max_travel_rad;
}

/// A joint with end stops is never pushed beyond its limit, and starts and stops gently.
hal::JointCommand ExperimentTask::bounded(const Channel& channel, hal::JointCommand wanted,
                                          const hal::RobotCommand& sent) const noexcept {
  if (!channel.joint.fit) return wanted;
  if (wanted.mode == hal::CommandMode::kTorque) {
    const double limit_Nm = channel.joint.fit->torque_limit_Nm();
    wanted.target = std::clamp(wanted.target, -limit_Nm, limit_Nm);
    return wanted;
  }
  const hal::JointCommand& last = sent.joints[channel.joint.index];
  const double last_rad_per_s =
      last.mode == hal::CommandMode::kVelocity ? last.target : channel.reading.velocity_rad_per_s;
  wanted.target = gently(last_rad_per_s, wanted.target, seconds(config_.period));
  return wanted;
}

void ExperimentTask::record_row(const Moment& moment) noexcept {
  record_.kind = ExperimentRecord::Kind::kRow;
  record_.measurement = measurement_;
  record_.time_s = config_.first_time_s + seconds(moment.now - measuring_since_);
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    Channel& channel = channels_[i];
    const hal::JointCommand& command = moment.sent.joints[channel.joint.index];
    auto& values = record_.values[i];
    values[ExperimentRecord::kTorqueMeasured] = channel.torque_sum_Nm / cycles_since_row_;
    values[ExperimentRecord::kPosition] = channel.reading.position_rad;
    values[ExperimentRecord::kVelocity] = channel.reading.velocity_rad_per_s;
    values[ExperimentRecord::kTorqueCommand] = target(command, hal::CommandMode::kTorque);
    values[ExperimentRecord::kVelocityCommand] = target(command, hal::CommandMode::kVelocity);
    values[ExperimentRecord::kPositionCommand] = channel.position_command_rad;
    channel.torque_sum_Nm = 0.0;
  }
  cycles_since_row_ = 0;
  push();
}

void ExperimentTask::record_results(nanoseconds now) noexcept {
  record_.kind = ExperimentRecord::Kind::kResult;
  record_.measurement = measurement_;
  record_.time_s = config_.first_time_s + seconds(now - measuring_since_);
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const identification::experiments::JointExperiment& experiment = *channels_[i].joint.experiment;
    experiment.write_result(std::span(record_.values[i]).first(experiment.result_columns().size()));
  }
  push();
}

void ExperimentTask::push() noexcept {
  if (config_.wait_for_recording) recording_.wait_for_room();
  recording_.add(record_);
}

Verdict ExperimentTask::brake(const Moment& moment, hal::RobotCommand& command,
                              double& fastest_rad_per_s) noexcept {
  const auto rest = hal::JointCommand::velocity_rad_per_s(0.0);
  fastest_rad_per_s = 0.0;
  for (const Channel& channel : channels_) {
    // A joint pressed against an obstacle must not be pushed further.
    command.joints[channel.joint.index] = pressed_ ? rest : bounded(channel, rest, moment.sent);
    const double speed_rad_per_s = std::abs(channel.reading.velocity_rad_per_s);
    // NaN: nothing shows that it rests.
    fastest_rad_per_s =
        std::max(fastest_rad_per_s,
                 std::isnan(speed_rad_per_s) ? std::numeric_limits<double>::infinity() : speed_rad_per_s);
  }
  return {};
}

}  // namespace youbot_bench
