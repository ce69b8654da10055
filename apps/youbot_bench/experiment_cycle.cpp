#include "apps/youbot_bench/experiment_cycle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "hal/seconds.h"

namespace youbot_bench {
namespace {

using hal::seconds;

using std::chrono::nanoseconds;

/// A cycle that comes later than this has lost control of what moves.
constexpr std::chrono::milliseconds kLongestGap{100};
/// Braking ends when all joints have been slower than this for as long, or after the timeout.
constexpr double kRest_rad_per_s = 0.05;
constexpr std::chrono::milliseconds kRestHold{50};
constexpr std::chrono::milliseconds kBrakeTimeout{2000};
/// Cycles with the drives off before the loop ends, so that every drive has heard it.
constexpr std::chrono::milliseconds kOffHold{20};

double target(const hal::JointCommand& command, hal::CommandMode mode) noexcept {
  return command.mode == mode ? command.target : 0.0;
}

}  // namespace

ExperimentCycle::ExperimentCycle(const Config& config, hal::Robot& robot, std::vector<Joint> joints,
                                 ExperimentRecording& recording)
    : config_(config),
      robot_(robot),
      recording_(recording),
      measurement_count_(joints.front().experiment->measurement_count()),
      measurement_(config.first_measurement) {
  const control::StateVariableFilter filter(
      {.cutoff_rad_per_s = config.filter_cutoff_rad_per_s, .period_s = seconds(config.period)});
  for (Joint& joint : joints) {
    Channel channel{.joint = std::move(joint), .filter = filter, .reading = {}};
    channels_.push_back(std::move(channel));
  }
  // Nobody moves the arm; without torque it would fall.
  for (std::size_t i = 0; i < robot.joints().size(); ++i)
    if (robot.joints()[i].name.starts_with("arm"))
      command_.joints[i] = hal::JointCommand::velocity_rad_per_s(0.0);
}

void ExperimentCycle::step(nanoseconds now) noexcept {
  if (!std::exchange(started_, true)) first_ = now_ = phase_begin_ = now;
  const nanoseconds gap = now - now_;
  now_ = now;
  const hal::CycleStatus status = robot_.exchange(command_, sample_);
  if (!status.ok() && phase_ != Phase::kFaulted)
    fail({.kind = ExperimentStop::Kind::kRobotFault, .joint = status.joint, .status = status});
  if (gap > kLongestGap && (phase_ == Phase::kMeasuring || phase_ == Phase::kBraking))
    fail({.kind = ExperimentStop::Kind::kStalled, .value = seconds(gap)});

  switch (phase_) {
    case Phase::kStarting:
      command_.enable = true;
      if (sample_.enabled) {
        for (Channel& channel : channels_)
          channel.filter.reset(sample_.joints[channel.joint.index].position_rad);
        enter(Phase::kMeasuring);
        measuring_since_ = now;
        applied_ = command_;
        sense();
        for (Channel& channel : channels_) channel.torque_sum_Nm = 0.0;
        begin_measurement();
      } else if (now - phase_begin_ > config_.enable_timeout) {
        fail({.kind = ExperimentStop::Kind::kNotEnabled});
      }
      break;
    case Phase::kMeasuring:
      sense();
      if (sample_.enabled)
        measure();
      else
        fail({.kind = ExperimentStop::Kind::kNotObeying});
      break;
    case Phase::kBraking:
      sense();
      brake();
      break;
    case Phase::kFaulted:
    case Phase::kOff: break;
  }
  applied_ = command_;
}

void ExperimentCycle::sense() noexcept {
  reading_time_s_ = seconds(now_ - measurement_begin_);
  for (Channel& channel : channels_) {
    const std::size_t index = channel.joint.index;
    const hal::JointSample& joint = sample_.joints[index];
    channel.reading.time_s = reading_time_s_;
    channel.reading.position_rad = joint.position_rad;
    channel.reading.velocity_rad_per_s = channel.filter.step(joint.position_rad).velocity;
    channel.reading.torque_Nm = joint.torque_Nm;
    channel.torque_sum_Nm += joint.torque_Nm;
  }
}

void ExperimentCycle::begin_measurement() noexcept {
  measurement_begin_ = now_;
  reading_time_s_ = 0.0;
  for (Channel& channel : channels_) {
    channel.reading.time_s = 0.0;
    channel.origin_rad = channel.reading.position_rad;
    channel.joint.experiment->begin(measurement_, channel.reading);
  }
}

void ExperimentCycle::measure() noexcept {
  if (++cycles_since_row_ >= config_.cycles_per_row) record_row();
  for (Channel& channel : channels_) {
    const double speed = channel.reading.velocity_rad_per_s;
    const double travel_rad = channel.reading.position_rad - channel.origin_rad;
    if (std::abs(speed) > config_.max_speed_rad_per_s)
      return fail({.kind = ExperimentStop::Kind::kOverspeed,
                   .joint = static_cast<int>(channel.joint.index),
                   .value = speed});
    if (config_.max_travel_rad > 0 && std::abs(travel_rad) > config_.max_travel_rad)
      return fail({.kind = ExperimentStop::Kind::kTooFar,
                   .joint = static_cast<int>(channel.joint.index),
                   .value = travel_rad});
  }

  bool all_finished = true;
  for (Channel& channel : channels_) {
    const sim::experiments::SetPoint set_point = channel.joint.experiment->step(channel.reading);
    hal::JointCommand& command = command_.joints[channel.joint.index];
    command = set_point.command;
    channel.position_command_rad = set_point.position_command_rad;
    // What the next values will answer to: the values of an exchange belong to the command before its own.
    channel.reading.command_Nm = applied_.joints[channel.joint.index].mode == hal::CommandMode::kTorque
                                     ? applied_.joints[channel.joint.index].target
                                     : sim::experiments::kUnknown;
    all_finished = all_finished && channel.joint.experiment->finished();
  }
  if (!all_finished) return;
  record_results();
  if (++measurement_ < measurement_count_)
    begin_measurement();
  else
    enter(Phase::kBraking);
}

void ExperimentCycle::record_row() noexcept {
  record_.kind = ExperimentRecord::Kind::kRow;
  record_.measurement = measurement_;
  record_.time_s = config_.first_time_s + seconds(now_ - measuring_since_);
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    Channel& channel = channels_[i];
    const hal::JointCommand& command = applied_.joints[channel.joint.index];
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

void ExperimentCycle::record_results() noexcept {
  record_.kind = ExperimentRecord::Kind::kResult;
  record_.measurement = measurement_;
  record_.time_s = config_.first_time_s + seconds(now_ - measuring_since_);
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const sim::experiments::JointExperiment& experiment = *channels_[i].joint.experiment;
    experiment.write_result(std::span(record_.values[i]).first(experiment.result_columns().size()));
  }
  push();
}

void ExperimentCycle::push() noexcept {
  if (config_.wait_for_recording) recording_.wait_for_room();
  recording_.add(record_);
}

void ExperimentCycle::brake() noexcept {
  double fastest = 0.0;
  for (const Channel& channel : channels_) {
    command_.joints[channel.joint.index] = hal::JointCommand::velocity_rad_per_s(0.0);
    fastest = std::max(fastest, std::abs(channel.reading.velocity_rad_per_s));
  }
  if (fastest >= kRest_rad_per_s) last_motion_ = now_;
  const bool resting = now_ - last_motion_ >= kRestHold;
  const bool too_long = now_ - phase_begin_ > kBrakeTimeout;
  if (!resting && too_long) keep({.kind = ExperimentStop::Kind::kNotAtRest, .value = fastest});
  if (resting || too_long) {
    command_ = {};
    enter(Phase::kOff);
  }
}

void ExperimentCycle::request_stop() noexcept {
  if (phase_ == Phase::kMeasuring) enter(Phase::kBraking);
  if (phase_ != Phase::kStarting) return;
  command_ = {};
  enter(Phase::kOff);
}

bool ExperimentCycle::finished() const noexcept {
  return (phase_ == Phase::kOff || phase_ == Phase::kFaulted) && now_ - phase_begin_ >= kOffHold;
}

void ExperimentCycle::enter(Phase phase) noexcept {
  phase_ = phase;
  phase_begin_ = last_motion_ = now_;
}

void ExperimentCycle::fail(const ExperimentStop& stop) noexcept {
  keep(stop);
  command_ = {};
  enter(Phase::kFaulted);
}

void ExperimentCycle::keep(ExperimentStop stop) noexcept {
  if (stop_) return;
  stop.measurement = measurement_;
  stop.time = now_ - first_;
  stop_ = stop;
}

std::string describe(const ExperimentStop& stop, const hal::Robot& robot) {
  const auto name = [&robot](int joint) {
    return joint >= 0 ? robot.joints()[static_cast<std::size_t>(joint)].name : std::string("the robot");
  };
  const auto number = [](const char* format, double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), format, value);
    return std::string(text.data());
  };
  const std::string when = "measurement " + std::to_string(stop.measurement + 1) + ", " +
                           number("%.3f", seconds(stop.time)) + " s: ";
  switch (stop.kind) {
    case ExperimentStop::Kind::kNone: return "no reason";
    case ExperimentStop::Kind::kRobotFault: {
      const hal::CycleStatus& status = stop.status;
      return when + name(status.joint) + ": " + robot.explain(status) + "; drives switched off";
    }
    case ExperimentStop::Kind::kNotEnabled: return when + "the drives did not start to obey in time";
    case ExperimentStop::Kind::kNotObeying: return when + "the drives went off by themselves";
    case ExperimentStop::Kind::kStalled:
      return when + "this program did not run for " + number("%.3f", stop.value) + " s; drives switched off";
    case ExperimentStop::Kind::kOverspeed:
      return when + name(stop.joint) + " turned at " + number("%.2f", stop.value) +
             " rad/s, more than --max-speed; drives switched off";
    case ExperimentStop::Kind::kTooFar:
      return when + name(stop.joint) + " moved by " + number("%.3f", stop.value) +
             " rad in this measurement, more than --max-travel; drives switched off";
    case ExperimentStop::Kind::kNotAtRest:
      return when + "braking for 2 s left " + number("%.2f", stop.value) + " rad/s; drives switched off";
  }
  return when + "unknown reason";
}

}  // namespace youbot_bench
