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
using identification::experiments::gently;

using std::chrono::nanoseconds;

/// A cycle that comes later than this has lost control of what moves.
constexpr std::chrono::milliseconds kLongestGap{100};
/// Braking ends when all joints have been slower than this for as long, or after the timeout.
constexpr double kRest_rad_per_s = 0.05;
constexpr std::chrono::milliseconds kRestHold{50};
constexpr std::chrono::milliseconds kBrakeTimeout{2000};
/// Cycles with the drives off before the loop ends, so that every drive has heard it.
constexpr std::chrono::milliseconds kOffHold{20};
/// How a joint is taken to where it is to begin, and how near is near enough.
constexpr double kPlacing_rad_per_s = 0.2;
constexpr double kPlacingGain_per_s = 2.0;
constexpr double kPlaced_rad = 0.005;
constexpr std::chrono::seconds kPlacingTimeout{60};
/// Times its speed limit, at which a joint with end stops may be commanded.
constexpr double kOvershoot = 1.1;

double target(const hal::JointCommand& command, hal::CommandMode mode) noexcept {
  return command.mode == mode ? command.target : 0.0;
}

}  // namespace

ExperimentCycle::ExperimentCycle(const Config& config, hal::Robot& robot, std::vector<Joint> joints,
                                 ExperimentRecording& recording)
    : config_(config),
      robot_(robot, control::PlausibilityMonitor::Wheels::kFree, config.checks_off),
      recording_(recording),
      measurement_count_(joints.front().experiment->measurement_count()),
      measurement_(config.first_measurement) {
  const control::StateVariableFilter filter(
      {.cutoff_rad_per_s = config.filter_cutoff_rad_per_s, .period_s = seconds(config.period)});
  for (Joint& joint : joints) {
    const hal::JointInfo& info = robot.joints()[joint.index];
    double max_speed_rad_per_s = config.max_speed_rad_per_s;
    if (joint.fit)
      max_speed_rad_per_s = std::min(max_speed_rad_per_s, kOvershoot * info.speed_limit_rad_per_s);
    has_end_stops_ = has_end_stops_ || joint.fit;
    channels_.push_back({.joint = std::move(joint),
                         .filter = filter,
                         .guard = JointGuard(info, seconds(config.period)),
                         .max_speed_rad_per_s = max_speed_rad_per_s});
  }
  // The arm is not controlled here; without torque it would fall.
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
  const bool moves = phase_ == Phase::kPlacing || phase_ == Phase::kMeasuring || phase_ == Phase::kBraking;
  if (gap > kLongestGap && moves) fail({.kind = ExperimentStop::Kind::kStalled, .value = seconds(gap)});

  switch (phase_) {
    case Phase::kStarting:
      command_.enable = true;
      if (sample_.enabled) {
        start();
      } else if (now - phase_begin_ > config_.enable_timeout) {
        fail({.kind = ExperimentStop::Kind::kNotEnabled});
      }
      break;
    case Phase::kPlacing:
    case Phase::kMeasuring:
      sense();
      if (!sample_.enabled)
        fail({.kind = ExperimentStop::Kind::kNotObeying});
      else if (phase_ == Phase::kPlacing)
        place();
      else
        measure();
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

void ExperimentCycle::start() noexcept {
  if (!fits()) {
    command_ = {};
    return enter(Phase::kOff);
  }
  for (Channel& channel : channels_) {
    const hal::JointSample& joint = sample_.joints[channel.joint.index];
    channel.filter.reset(joint.position_rad);
    channel.start_rad = channel.joint.fit ? channel.joint.fit->start_rad(joint) : joint.position_rad;
  }
  applied_ = command_;
  sense();
  enter(Phase::kPlacing);
  place();
}

/// Until each joint rests where its experiment begins.
void ExperimentCycle::place() noexcept {
  bool all_there = true;
  for (Channel& channel : channels_) {
    const double left_rad = channel.start_rad - channel.reading.position_rad;
    if (!channel.joint.fit ||
        (std::abs(left_rad) < kPlaced_rad && std::abs(channel.reading.velocity_rad_per_s) < kRest_rad_per_s))
      continue;
    all_there = false;
    if (now_ - phase_begin_ > kPlacingTimeout)
      return halt({.kind = ExperimentStop::Kind::kNotPlaced,
                   .joint = static_cast<int>(channel.joint.index),
                   .value = channel.reading.position_rad});
    if (!watch(channel)) return;
    const double wanted = std::clamp(kPlacingGain_per_s * left_rad, -kPlacing_rad_per_s, kPlacing_rad_per_s);
    command_.joints[channel.joint.index] = bounded(channel, hal::JointCommand::velocity_rad_per_s(wanted));
  }
  if (all_there) begin_measuring();
}

void ExperimentCycle::begin_measuring() noexcept {
  enter(Phase::kMeasuring);
  measuring_since_ = now_;
  for (Channel& channel : channels_) channel.torque_sum_Nm = 0.0;
  begin_measurement();
}

bool ExperimentCycle::fits() noexcept {
  for (Channel& channel : channels_) {
    if (!channel.joint.fit) continue;
    if (const Misfit misfit = channel.joint.fit->check(sample_)) {
      keep({.kind = ExperimentStop::Kind::kMisfit,
            .joint = static_cast<int>(channel.joint.index),
            .misfit = misfit});
      return false;
    }
  }
  return true;
}

std::string ExperimentCycle::misfit() const {
  for (const Channel& channel : channels_)
    if (stop_.kind == ExperimentStop::Kind::kMisfit && static_cast<int>(channel.joint.index) == stop_.joint)
      return channel.joint.fit->describe(stop_.misfit, robot_.joints());
  return {};
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
  for (Channel& channel : channels_)
    if (!watch(channel)) return;

  bool all_finished = true;
  for (Channel& channel : channels_) {
    const identification::experiments::SetPoint set_point = channel.joint.experiment->step(channel.reading);
    hal::JointCommand& command = command_.joints[channel.joint.index];
    command = bounded(channel, set_point.command);
    channel.position_command_rad = set_point.position_command_rad;
    // What the next values will answer to: the values of an exchange belong to the command before its own.
    channel.reading.command_Nm = applied_.joints[channel.joint.index].mode == hal::CommandMode::kTorque
                                     ? applied_.joints[channel.joint.index].target
                                     : identification::experiments::kUnknown;
    all_finished = all_finished && channel.joint.experiment->finished();
  }
  if (!all_finished) return;
  record_results();
  if (++measurement_ < measurement_count_)
    begin_measurement();
  else
    enter(Phase::kBraking);
}

/// False when it had to be stopped.
bool ExperimentCycle::watch(Channel& channel) noexcept {
  using Kind = ExperimentStop::Kind;
  const identification::experiments::Reading& reading = channel.reading;
  ExperimentStop stop{.joint = static_cast<int>(channel.joint.index)};
  if (std::abs(reading.velocity_rad_per_s) > channel.max_speed_rad_per_s) {
    stop.kind = Kind::kOverspeed;
    stop.value = reading.velocity_rad_per_s;
  } else if (goes_too_far(channel)) {
    stop.kind = Kind::kTooFar;
    stop.value = reading.position_rad - channel.origin_rad;
  } else {
    const JointGuard::Trip trip = channel.guard.watch(reading, applied_.joints[channel.joint.index]);
    stop.value = channel.guard.torque_Nm();
    switch (trip) {
      case JointGuard::Trip::kNone: return true;
      case JointGuard::Trip::kNearStop:
        stop.kind = Kind::kNearStop;
        stop.value = reading.position_rad;
        break;
      case JointGuard::Trip::kTorque: stop.kind = Kind::kTorque; break;
      case JointGuard::Trip::kBlocked: stop.kind = Kind::kBlocked; break;
    }
  }
  halt(stop);
  return false;
}

/// A joint with end stops is stopped in time, before it has gone too far.
bool ExperimentCycle::goes_too_far(const Channel& channel) const noexcept {
  if (phase_ != Phase::kMeasuring || config_.max_travel_rad <= 0) return false;
  const double velocity = channel.reading.velocity_rad_per_s;
  double travel_rad = channel.reading.position_rad - channel.origin_rad;
  if (channel.joint.fit)
    travel_rad +=
        std::copysign(identification::experiments::stopping_distance_rad(std::abs(velocity)), velocity);
  return std::abs(travel_rad) > config_.max_travel_rad;
}

/// A joint with end stops is never pushed beyond its limit, and starts and stops gently.
hal::JointCommand ExperimentCycle::bounded(const Channel& channel, hal::JointCommand wanted) const noexcept {
  if (!channel.joint.fit) return wanted;
  if (wanted.mode == hal::CommandMode::kTorque) {
    const double limit_Nm = channel.joint.fit->torque_limit_Nm();
    wanted.target = std::clamp(wanted.target, -limit_Nm, limit_Nm);
    return wanted;
  }
  const hal::JointCommand& last = applied_.joints[channel.joint.index];
  const double last_rad_per_s =
      last.mode == hal::CommandMode::kVelocity ? last.target : channel.reading.velocity_rad_per_s;
  wanted.target = gently(last_rad_per_s, wanted.target, seconds(config_.period));
  return wanted;
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
    const identification::experiments::JointExperiment& experiment = *channels_[i].joint.experiment;
    experiment.write_result(std::span(record_.values[i]).first(experiment.result_columns().size()));
  }
  push();
}

void ExperimentCycle::push() noexcept {
  if (config_.wait_for_recording) recording_.wait_for_room();
  recording_.add(record_);
}

void ExperimentCycle::brake() noexcept {
  // What is pressed against something must not be pushed on.
  const bool at_once =
      stop_.kind == ExperimentStop::Kind::kTorque || stop_.kind == ExperimentStop::Kind::kBlocked;
  const auto rest = hal::JointCommand::velocity_rad_per_s(0.0);
  double fastest = 0.0;
  for (const Channel& channel : channels_) {
    command_.joints[channel.joint.index] = at_once ? rest : bounded(channel, rest);
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
  if (phase_ == Phase::kPlacing || phase_ == Phase::kMeasuring) enter(Phase::kBraking);
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

void ExperimentCycle::halt(const ExperimentStop& stop) noexcept {
  if (!has_end_stops_) return fail(stop);
  keep(stop);
  enter(Phase::kBraking);
}

void ExperimentCycle::keep(ExperimentStop stop) noexcept {
  if (stop_) return;
  stop.measurement = measurement_;
  stop.time = now_ - first_;
  stop_ = stop;
}

std::string describe(const ExperimentStop& stop, const hal::Robot& robot) {
  const auto info = [&robot](int joint) -> const hal::JointInfo& {
    return robot.joints()[static_cast<std::size_t>(joint)];
  };
  const auto name = [&info](int joint) { return joint >= 0 ? info(joint).name : std::string("the robot"); };
  const auto number = [](const char* format, double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), format, value);
    return std::string(text.data());
  };
  const auto or_its_limit = [&](int joint) {
    return info(joint).range.limited()
               ? " or its limit of " + number("%.3g", info(joint).speed_limit_rad_per_s) + " rad/s"
               : std::string();
  };
  const std::string off = "; drives switched off";
  const std::string when = "measurement " + std::to_string(stop.measurement + 1) + ", " +
                           number("%.3f", seconds(stop.time)) + " s: ";
  switch (stop.kind) {
    case ExperimentStop::Kind::kNone: return "no reason";
    case ExperimentStop::Kind::kRobotFault: {
      const hal::CycleStatus& status = stop.status;
      return when + name(status.joint) + ": " + robot.explain(status) + off;
    }
    case ExperimentStop::Kind::kNotEnabled:
      return when + "the drives did not start to obey in time: check the emergency stop and the 24 V";
    case ExperimentStop::Kind::kNotObeying: return when + "the drives went off by themselves";
    case ExperimentStop::Kind::kStalled:
      return when + "this program did not run for " + number("%.3f", stop.value) + " s" + off;
    case ExperimentStop::Kind::kOverspeed:
      return when + name(stop.joint) + " turned at " + number("%.2f", stop.value) +
             " rad/s, more than --max-speed" + or_its_limit(stop.joint) + off;
    case ExperimentStop::Kind::kTooFar:
      return when + name(stop.joint) + " moved by " + number("%.3f", stop.value) +
             " rad in this measurement" +
             (info(stop.joint).range.limited() ? " and would go on beyond --max-travel"
                                               : ", more than --max-travel") +
             off;
    case ExperimentStop::Kind::kMisfit: return when + "the experiment does not fit " + name(stop.joint);
    case ExperimentStop::Kind::kNearStop:
      return when + name(stop.joint) + " came near the end of its range, at " + number("%.3f", stop.value) +
             " rad" + off;
    case ExperimentStop::Kind::kTorque:
      return when + name(stop.joint) + " took " + number("%.2f", stop.value) + " N·m, more than the " +
             number("%.3g", info(stop.joint).rated_torque_Nm) + " N·m it is made for" + off;
    case ExperimentStop::Kind::kBlocked:
      return when + name(stop.joint) + " is blocked: it took " + number("%.2f", stop.value) +
             " N·m and did not turn" + off;
    case ExperimentStop::Kind::kNotPlaced:
      return when + name(stop.joint) + " did not reach --start in time; it is at " +
             number("%.3f", stop.value) + " rad" + off;
    case ExperimentStop::Kind::kNotAtRest:
      return when + "braking for 2 s left " + number("%.2f", stop.value) + " rad/s" + off +
             ": see what turns the joint";
  }
  return when + "unknown reason";
}

}  // namespace youbot_bench
