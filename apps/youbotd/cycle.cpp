#include "apps/youbotd/cycle.h"

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "apps/youbotd/stop_hints.h"

namespace youbotd {
namespace {

using std::chrono::nanoseconds;

/// Braking ends when all wheels are slower than this, or by force after the timeout.
constexpr double kRest_rad_per_s = 0.02;
/// That long, since the filter needs some 15 ms to know a velocity.
constexpr std::chrono::milliseconds kRestHold{50};
constexpr std::chrono::milliseconds kBrakeTimeout{2000};
/// Cycles with the drives off before the loop ends, so that every drive has heard it.
constexpr std::chrono::milliseconds kOffHold{20};
constexpr const char* kBehindHint =
    "); braked and switched off: see what holds it back, or raise limits.force_N and limits.moment_Nm";

control::WheelVector wheel_positions(const hal::RobotSample& sample) noexcept {
  control::WheelVector position_rad;
  for (std::size_t i = 0; i < kWheels; ++i)
    position_rad[static_cast<Eigen::Index>(i)] = sample.joints[i].position_rad;
  return position_rad;
}

Eigen::Vector2d place_m(const control::PlanarPose& pose) noexcept { return {pose.x_m, pose.y_m}; }

/// A base that was pushed out of its workspace may drive back from there.
double allowed_outside_m(const Cycle::Config& config) noexcept {
  constexpr double kMargin_m = control::Workspace::kMargin_m;
  const double at_start_m = control::outside_m(config.workspace.base_W_m, place_m(config.start));
  return at_start_m > kMargin_m ? at_start_m + kMargin_m : kMargin_m;
}

std::array<double, 3> as_array(const control::PlanarPose& pose) noexcept {
  return {pose.x_m, pose.y_m, pose.yaw_rad};
}

}  // namespace

Cycle::Cycle(const Config& config, hal::Robot& robot, MotionSource& motion, const control::PlanarPose* truth)
    : config_(config),
      robot_(robot, control::PlausibilityMonitor::Wheels::kRolling, config.checks_off),
      motion_(motion),
      truth_(truth),
      controller_(config.controller),
      reference_limiter_(config.setpoint),
      sample_clock_(config.period),
      X_WB_(config.start),
      may_be_outside_m_(allowed_outside_m(config)) {
  if (robot.joints().size() < kWheels)
    throw std::invalid_argument("the base needs a robot with four wheels, this one has " +
                                std::to_string(robot.joints().size()) +
                                (robot.joints().size() == 1 ? " joint" : " joints"));
  for (const hal::JointInfo& wheel : robot.joints().first(kWheels))
    if (config.controller.torque_limit_Nm > wheel.torque_limit_Nm)
      throw std::invalid_argument(
          "limits.wheel_torque_Nm = " + std::to_string(config.controller.torque_limit_Nm) +
          " is more than the " + std::to_string(wheel.torque_limit_Nm) + " N·m that " + wheel.name +
          " can deliver");
  const double period_s = std::chrono::duration<double>(config.period).count();
  record_.odometry_W = as_array(config.start);
  for (std::size_t i = 0; i < kWheels; ++i)
    torque_rates_[i] =
        control::TorqueRate(config.torque_rate_per_s * robot.joints()[i].torque_limit_Nm, period_s);
  speed_proofs_.fill(control::SpeedProof(config.wheel_speed_limit_rad_per_s));
}

void Cycle::step(nanoseconds now) noexcept {
  if (count_++ == 0) first_ = phase_begin_ = now_ = now;
  const nanoseconds gap = now - now_;
  now_ = now;
  record_ = {};
  record_.time = now - first_;
  record_.phase = phase_;
  if (truth_ != nullptr) record_.truth_W = as_array(*truth_);

  // Stopped by a debugger or starved: what was computed before is not to act now.
  const bool stalled = gap > config_.command_timeout;
  if (stalled) pause_.note(now, gap);
  if (stalled)
    for (std::size_t i = 0; i < kWheels; ++i) command_.joints[i] = {};
  const hal::CycleStatus status = robot_.exchange(command_, sample_);
  for (std::size_t i = 0; i < kWheels; ++i) {
    record_.torque_command_Nm[i] = sample_.enabled ? command_.joints[i].target : 0.0;
    record_.torque_measured_Nm[i] = sample_.joints[i].torque_Nm;
    record_.position_rad[i] = sample_.joints[i].position_rad;
    record_.reported_velocity_rad_per_s[i] = sample_.joints[i].velocity_rad_per_s;
  }
  if (!status.ok() && phase_ != Phase::kFaulted)
    fail({.kind = StopReason::Kind::kRobotFault,
          .joint = status.joint,
          .status = status,
          .pause = pause_.before(now)},
         now);

  const control::WheelVector position_rad = wheel_positions(sample_);
  const double elapsed_s = sample_clock_.elapsed_s(sample_.stamp);
  for (std::size_t i = 0; i < kWheels && elapsed_s > 0; ++i)
    speed_proofs_[i].update(sample_.joints[i].position_rad, bounds_of(sample_));
  // The reference has gone on without us: not to be chased.
  if (stalled) {
    controller_.forget_velocity(position_rad);
    if (phase_ == Phase::kRunning) {
      keep({.kind = StopReason::Kind::kStalled, .value = std::chrono::duration<double>(gap).count()});
      enter(Phase::kStopping, now);
    }
  }

  switch (phase_) {
    case Phase::kStarting:
      keep_record(controller_.observe(position_rad, elapsed_s));
      command_.enable = true;
      if (sample_.enabled) {
        controller_.reset(position_rad, X_WB_);
        for (control::SpeedProof& proof : speed_proofs_) proof.restart();
        obeyed_ = true;
        motion_.begin(now, X_WB_);
        reference_limiter_.reset(X_WB_);
        followed_ = last_reference_ = now;
        enter(Phase::kRunning, now);
      } else if (now - phase_begin_ > config_.enable_timeout) {
        fail({.kind = StopReason::Kind::kNotEnabled,
              .value = std::chrono::duration<double>(config_.enable_timeout).count()},
             now);
      }
      break;
    case Phase::kRunning: run(now, position_rad, elapsed_s); break;
    case Phase::kStopping: brake(now, position_rad, elapsed_s); break;
    case Phase::kFaulted:
    case Phase::kOff: keep_record(controller_.observe(position_rad, elapsed_s)); break;
  }
}

void Cycle::run(nanoseconds now, const control::WheelVector& position_rad, double elapsed_s) noexcept {
  const Motion motion = motion_.read(now, X_WB_);
  const control::BaseReference reference = limit(motion.reference, now);
  const nanoseconds age = now - motion.stamp;
  if (age > config_.command_timeout) {
    keep({.kind = StopReason::Kind::kCommandTimeout, .value = std::chrono::duration<double>(age).count()});
    enter(Phase::kStopping, now);
  } else if (motion.finished && !reference_limiter_.limited()) {
    // A reference that was slowed down is still on its way when the motion that asked for it is over.
    enter(Phase::kStopping, now);
  } else {
    check_following(reference.X_WB, now);
    check_workspace(now);
  }
  record_.reference_W = as_array(reference.X_WB);
  if (phase_ == Phase::kStopping)
    brake(now, position_rad, elapsed_s);
  else
    apply(controller_.step(position_rad, reference, elapsed_s));
  if (reference_limiter_.limited()) record_.limited |= limiter::kSetpoint;
  if (motion.at_wall) record_.limited |= limiter::kWorkspace;
}

control::BaseReference Cycle::limit(const control::BaseReference& wanted_W, nanoseconds now) noexcept {
  const auto seconds = [](nanoseconds time) { return std::chrono::duration<double>(time).count(); };
  const nanoseconds elapsed = now - std::exchange(last_reference_, now);
  return reference_limiter_.step(wanted_W, seconds(elapsed > nanoseconds(0) ? elapsed : config_.period),
                                 seconds(config_.period));
}

void Cycle::check_following(const control::PlanarPose& reference_W, nanoseconds now) noexcept {
  const double off_m = std::hypot(reference_W.x_m - X_WB_.x_m, reference_W.y_m - X_WB_.y_m);
  const double off_rad = std::abs(reference_W.yaw_rad - X_WB_.yaw_rad);
  const bool near = off_m <= config_.following_error_m;
  if (near && off_rad <= config_.following_error_rad) followed_ = now;
  if (now - followed_ <= kFollowingTime) return;
  using Kind = StopReason::Kind;
  if (near)
    keep({.kind = Kind::kTurnedBehind, .value = off_rad, .limit = config_.following_error_rad});
  else
    keep({.kind = Kind::kBehind, .value = off_m, .limit = config_.following_error_m});
  enter(Phase::kStopping, now);
}

void Cycle::check_workspace(nanoseconds now) noexcept {
  const double out_m = control::outside_m(config_.workspace.base_W_m, place_m(X_WB_));
  if (out_m <= may_be_outside_m_) return;
  keep({.kind = StopReason::Kind::kOutside, .value = out_m, .limit = may_be_outside_m_});
  enter(Phase::kStopping, now);
}

void Cycle::brake(nanoseconds now, const control::WheelVector& position_rad, double elapsed_s) noexcept {
  const control::BaseController::Output output = controller_.brake(position_rad, elapsed_s);
  apply(output);
  if (phase_ != Phase::kStopping) return;
  const double fastest = output.wheel_velocity_rad_per_s.cwiseAbs().maxCoeff();
  if (fastest >= kRest_rad_per_s) last_motion_ = now;
  const bool resting = now - last_motion_ >= kRestHold;
  if (!resting && now - phase_begin_ > kBrakeTimeout)
    keep({.kind = StopReason::Kind::kNotAtRest, .value = fastest});
  if (resting || now - phase_begin_ > kBrakeTimeout) {
    command_ = {};
    enter(Phase::kOff, now);
  }
}

void Cycle::apply(const control::BaseController::Output& output) noexcept {
  keep_record(output);
  for (std::size_t i = 0; i < kWheels; ++i) {
    const double wanted_Nm = output.torque_Nm[static_cast<Eigen::Index>(i)];
    control::TorqueRate& rate = torque_rates_[i];
    command_.joints[i] =
        hal::JointCommand::torque_Nm(phase_ == Phase::kRunning ? rate.step(wanted_Nm) : rate.pass(wanted_Nm));
    if (rate.limited()) record_.limited |= limiter::kTorqueRate;
  }
  // The arm is not controlled yet; without torque it would fall.
  for (std::size_t i = kWheels; i < robot_.joints().size(); ++i)
    command_.joints[i] = hal::JointCommand::velocity_rad_per_s(0.0);
  for (std::size_t i = 0; i < kWheels; ++i)
    if (control::is_too_fast(record_.velocity_rad_per_s[i], config_.wheel_speed_limit_rad_per_s,
                             speed_proofs_[i]))
      fail({.kind = StopReason::Kind::kOverspeed,
            .joint = static_cast<int>(i),
            .value = record_.velocity_rad_per_s[i],
            .limit = config_.wheel_speed_limit_rad_per_s},
           now_);
}

void Cycle::keep_record(const control::BaseController::Output& output) noexcept {
  // Where its drives' commutation leaves it is the start, and stays it when they never obey.
  X_WB_ = obeyed_ ? output.X_WB : config_.start;
  record_.odometry_W = as_array(X_WB_);
  record_.limited = output.limited ? limiter::kEffort : 0;
  for (std::size_t i = 0; i < 3; ++i) record_.wrench_B[i] = output.wrench_B[static_cast<Eigen::Index>(i)];
  for (std::size_t i = 0; i < kWheels; ++i)
    record_.velocity_rad_per_s[i] = output.wheel_velocity_rad_per_s[static_cast<Eigen::Index>(i)];
}

void Cycle::request_stop() noexcept {
  switch (phase_) {
    case Phase::kStarting:
      command_ = {};
      enter(Phase::kOff, now_);
      break;
    case Phase::kRunning: enter(Phase::kStopping, now_); break;
    case Phase::kStopping:
    case Phase::kFaulted:
    case Phase::kOff: break;
  }
}

void Cycle::switch_off() noexcept {
  if (phase_ == Phase::kFaulted || phase_ == Phase::kOff) return;
  command_ = {};
  enter(Phase::kOff, now_);
}

bool Cycle::finished() const noexcept {
  return (phase_ == Phase::kOff || phase_ == Phase::kFaulted) && now_ - phase_begin_ >= kOffHold;
}

void Cycle::enter(Phase phase, nanoseconds now) noexcept {
  phase_ = phase;
  phase_begin_ = last_motion_ = now;
}

void Cycle::fail(StopReason reason, nanoseconds now) noexcept {
  keep(reason);
  command_ = {};
  enter(Phase::kFaulted, now);
}

void Cycle::keep(StopReason reason) noexcept {
  if (stop_reason_) return;
  stop_reason_ = reason;
  stop_reason_.cycle = count_;
  stop_reason_.time = now_ - first_;
}

std::string describe(const StopReason& reason, const hal::Robot& robot) {
  const auto name = [&robot](int joint) {
    return joint >= 0 ? robot.joints()[static_cast<std::size_t>(joint)].name : std::string("the robot");
  };
  const auto number = [](const char* format, double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), format, value);
    return std::string(text.data());
  };
  const std::string when = "cycle " + std::to_string(reason.cycle) + " (" +
                           number("%.3f", std::chrono::duration<double>(reason.time).count()) + " s): ";
  switch (reason.kind) {
    case StopReason::Kind::kNone: return "no stop reason";
    case StopReason::Kind::kRobotFault: {
      const hal::CycleStatus& status = reason.status;
      return when + then(reason.pause) + name(status.joint) + ": " + robot.explain(status) +
             "; drives switched off";
    }
    case StopReason::Kind::kNotEnabled:
      return when + "the drives did not start to obey within " + number("%g", reason.value) + " s" +
             kNotEnabledHint;
    case StopReason::Kind::kCommandTimeout:
      return when + "no new set-point for " + number("%.3f", reason.value) +
             " s; braked and switched off: see what holds up their source";
    case StopReason::Kind::kStalled:
      return when + "this program did not run for " + number("%.3f", reason.value) +
             " s; braked and switched off" + kStalledHint;
    case StopReason::Kind::kOverspeed:
      return when + name(reason.joint) + " turned at " + number("%.1f", reason.value) +
             " rad/s, more than allowed (limits.wheel_speed_rad_per_s = " + number("%g", reason.limit) +
             "); drives switched off";
    case StopReason::Kind::kNotAtRest:
      return when + "braking for 2 s did not bring the base to rest (" + number("%.2f", reason.value) +
             " rad/s); drives switched off: see what moves it, a slope or somebody who pushes";
    case StopReason::Kind::kBehind:
      return when + "the base was " + number("%.3f", reason.value) +
             " m from its reference, more than allowed (limits.following_error_m = " +
             number("%g", reason.limit) + kBehindHint;
    case StopReason::Kind::kTurnedBehind:
      return when + "the base was turned " + number("%.3f", reason.value) +
             " rad from its reference, more than allowed (limits.following_error_rad = " +
             number("%g", reason.limit) + kBehindHint;
    case StopReason::Kind::kOutside:
      return when + "the base was " + number("%.3f", reason.value) +
             " m outside [workspace], more than allowed (" + number("%g", reason.limit) +
             "); braked and switched off: drive it back inside by velocity";
  }
  return when + "unknown reason";
}

}  // namespace youbotd
