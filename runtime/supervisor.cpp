#include "runtime/supervisor.h"

#include <limits>
#include <span>

#include "hal/seconds.h"

namespace runtime {

using std::chrono::nanoseconds;

namespace {

/// An arm without torque falls; a wheel rolls out.
void rest(std::span<const hal::JointInfo> joints, hal::RobotCommand& command) noexcept {
  for (std::size_t i = 0; i < joints.size(); ++i)
    command.joints[i] =
        joints[i].range.limited() ? hal::JointCommand::velocity_rad_per_s(0.0) : hal::JointCommand{};
}

}  // namespace

Supervisor::Supervisor(const Config& config, hal::Robot& robot, Task& task)
    : config_(config), robot_(robot, config.wheels, config.checks_off, config.arm), task_(task) {
  rest(robot.joints(), command_);
}

void Supervisor::step(nanoseconds now) noexcept {
  if (count_++ == 0) first_ = phase_begin_ = now_ = now;
  const nanoseconds gap = now - now_;
  now_ = now;

  // Stopped by a debugger or starved: old results must not act now.
  const bool paused = gap > config_.command_timeout;
  if (paused) {
    pause_.note(now, gap);
    rest(robot_.joints(), command_);
  }
  sent_ = command_;
  const Moment moment{.now = now,
                      .time = now - first_,
                      .gap = gap,
                      .paused = paused,
                      .phase = phase_,
                      .status = status_,
                      .sample = sample_,
                      .sent = sent_};
  status_ = robot_.exchange(command_, sample_);
  task_.read(moment);

  if (!status_.ok() && phase_ != Phase::kFaulted)
    fail({.kind = StopReason::Kind::kRobotFault, .joint = status_.joint, .status = status_});
  if (phase_ == Phase::kRunning && !sample_.enabled) fail({.kind = StopReason::Kind::kNotObeying});
  if (paused) {
    const bool can_brake = task_.can_brake_after_pause(moment);
    const StopReason stalled{.kind = StopReason::Kind::kStalled, .value = hal::seconds(gap)};
    if (moves(phase_) && !can_brake) fail(stalled);
    if (phase_ == Phase::kRunning) {
      keep(stalled);
      enter(Phase::kStopping);
    } else if (phase_ == Phase::kStopping) {
      // The pause does not count as braking time, and the velocity estimate restarts at zero, which is not
      // rest.
      phase_begin_ = last_motion_ = now;
    }
  }

  switch (phase_) {
    case Phase::kStarting:
      command_.enable = true;
      if (const Verdict verdict = task_.wait(moment); verdict.next == Verdict::Next::kFail) {
        fail(verdict.reason);
      } else if (sample_.enabled) {
        enter(Phase::kRunning);
        follow(task_.begin(moment, command_), moment);
      } else if (now - phase_begin_ > config_.enable_timeout) {
        fail({.kind = StopReason::Kind::kNotEnabled, .value = hal::seconds(config_.enable_timeout)});
      }
      break;
    case Phase::kRunning: follow(task_.step(moment, command_), moment); break;
    case Phase::kStopping: brake(moment); break;
    case Phase::kFaulted:
    case Phase::kOff: (void)task_.wait(moment); break;
  }
}

void Supervisor::follow(const Verdict& verdict, const Moment& moment) noexcept {
  switch (verdict.next) {
    case Verdict::Next::kGoOn:
    case Verdict::Next::kRest: break;
    case Verdict::Next::kBrake:
      keep(verdict.reason);
      enter(Phase::kStopping);
      brake(moment);
      break;
    case Verdict::Next::kFail: fail(verdict.reason); break;
  }
}

void Supervisor::brake(const Moment& moment) noexcept {
  double fastest_rad_per_s = std::numeric_limits<double>::infinity();
  const Verdict verdict = task_.brake(moment, command_, fastest_rad_per_s);
  if (verdict.next == Verdict::Next::kFail) return fail(verdict.reason);
  // Negated so that NaN does not count as rest.
  if (!(fastest_rad_per_s < config_.rest_rad_per_s)) last_motion_ = now_;
  const bool resting = verdict.next == Verdict::Next::kRest || now_ - last_motion_ >= kRestHold;
  const nanoseconds timeout = task_.brake_timeout();
  const bool too_long = now_ - phase_begin_ > timeout;
  if (!resting && too_long)
    keep({.kind = StopReason::Kind::kNotAtRest, .value = fastest_rad_per_s, .limit = hal::seconds(timeout)});
  if (!resting && !too_long) return;
  command_ = {};
  enter(Phase::kOff);
}

void Supervisor::request_stop() noexcept {
  if (phase_ == Phase::kStarting) switch_off();
  if (phase_ == Phase::kRunning) enter(Phase::kStopping);
}

void Supervisor::switch_off() noexcept {
  if (phase_ == Phase::kFaulted || phase_ == Phase::kOff) return;
  command_ = {};
  enter(Phase::kOff);
}

bool Supervisor::finished() const noexcept {
  return (phase_ == Phase::kOff || phase_ == Phase::kFaulted) && now_ - phase_begin_ >= kOffHold;
}

void Supervisor::enter(Phase phase) noexcept {
  phase_ = phase;
  phase_begin_ = last_motion_ = now_;
}

void Supervisor::fail(const StopReason& reason) noexcept {
  keep(reason);
  command_ = {};
  enter(Phase::kFaulted);
}

void Supervisor::keep(StopReason reason) noexcept {
  reason.cycle = count_;
  reason.time = now_ - first_;
  reason.pause = pause_.before(now_);
  if (!stop_reason_)
    stop_reason_ = reason;
  else if (phase_ == Phase::kStopping && !cut_short_by_)
    cut_short_by_ = reason;
}

}  // namespace runtime
