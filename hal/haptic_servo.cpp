#include "hal/haptic_servo.h"

#include <algorithm>
#include <cmath>

#include "hal/seconds.h"
#include "hal/setup_error.h"

namespace hal {
namespace {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using std::chrono::nanoseconds;

bool finite(const HapticSample& sample) noexcept {
  return sample.p_HD_m.allFinite() && sample.q_HD.coeffs().allFinite();
}

/// `v` at most that long, in its direction.
Vector3d within(const Vector3d& v, double longest) noexcept {
  const double length = v.stableNorm();
  return length > longest ? Vector3d(v * (longest / length)) : v;
}

std::uint32_t whole_microseconds(nanoseconds time) noexcept {
  const auto count = std::chrono::duration_cast<std::chrono::microseconds>(time).count();
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(count, 0, INT32_MAX));
}

}  // namespace

std::vector<std::string> HapticLimits::problems() const {
  std::vector<std::string> found;
  const auto require = [&found](bool fulfilled, const char* what) {
    if (!fulfilled) found.emplace_back(what);
  };
  // As "within", so that NaN is refused.
  require(slew_N_per_s > 0.0 && slew_N_per_s <= 2000.0, "slew_N_per_s must be above 0 and at most 2000");
  require(speed_m_per_s > 0.0 && speed_m_per_s <= 2.0, "speed_m_per_s must be above 0 and at most 2");
  require(ramp_in >= 0ms && ramp_in <= 60s, "ramp_in must be 0 to 60 s");
  require(stale_after >= 2ms && stale_after <= 500ms, "stale_after must be 2 ms to 500 ms");
  require(command_timeout >= 2ms && command_timeout <= 100ms, "command_timeout must be 2 ms to 100 ms");
  require(velocity_cutoff_Hz > 0.0 && velocity_cutoff_Hz <= 1000.0,
          "velocity_cutoff_Hz must be above 0 and at most 1000");
  return found;
}

HapticServo::HapticServo(HapticLink& link, const HapticLimits& limits)
    : link_(link), limits_(limits), velocity_(limits.velocity_cutoff_Hz) {
  std::string all;
  for (const std::string& problem : limits.problems()) all += (all.empty() ? "" : "; ") + problem;
  if (!all.empty()) throw SetupError("haptic device", "check its limits", all);
}

void HapticServo::reset() noexcept {
  velocity_.reset();
  latched_ = {};
  previous_.reset();
  enabled_since_.reset();
  stamp_ = {};
  has_sample_ = false;
  sent_N_.setZero();
}

HapticStatus HapticServo::step(const HapticCommand& command, nanoseconds commanded, nanoseconds now,
                               HapticSample& sample) noexcept {
  const nanoseconds gap = previous_ ? now - *previous_ : 0ns;
  // Time without a force does not count: it could not have grown.
  const nanoseconds slewing = enabled_since_ ? std::clamp<nanoseconds>(gap, 0ns, limits_.stale_after) : 0ns;
  previous_ = now;
  if (!command.enable) {
    latched_ = {};
    enabled_since_.reset();
  } else {
    // A pause is harmless while the force is off.
    if (enabled_since_ && (gap < 0ns || gap > limits_.stale_after))
      latch({.fault = HapticFault::kStale, .detail = whole_microseconds(gap)});
    check_command(command, commanded, now);
    if (latched_.ok() && !enabled_since_) enabled_since_ = fresh_ = now;
  }

  const bool on = command.enable && latched_.ok();
  bool saturated = false;
  const Vector3d target_N = on ? shaped(command.f_D_H_N, now, saturated) : Vector3d::Zero();
  const double step_N = limits_.slew_N_per_s * seconds(slewing);
  sent_N_ = on ? Vector3d(sent_N_ + within(target_N - sent_N_, step_N)) : Vector3d::Zero();

  HapticSample measured;
  measured.stamp = stamp_;
  HapticStatus reading = link_.exchange({on, sent_N_}, now, measured);
  if (reading.fault == HapticFault::kMissed) reading.fault = HapticFault::kNone;  // only its age counts
  const bool good = finite(measured);
  if (reading.fault == HapticFault::kNotReady) {
    // The next position may be anywhere.
    velocity_.reset();
    enabled_since_.reset();
    sent_N_.setZero();
  } else if (good && measured.stamp > stamp_) {
    measured.v_HD_H_m_per_s = velocity_.update(measured.p_HD_m, measured.stamp);
    stamp_ = measured.stamp;
    has_sample_ = true;
    fresh_ = now;
    sample = measured;
  }
  if (reading.withheld && enabled_since_) {
    enabled_since_ = now;  // the samples go on: only the ramp begins again
    sent_N_.setZero();
  }
  check_reading(good ? reading : HapticStatus{.fault = HapticFault::kBadSample}, measured, now);

  HapticStatus status = latched_.ok() ? reading : latched_;
  status.saturated = on && (saturated || reading.saturated);
  status.age = has_sample_ ? now - stamp_ : nanoseconds::max();
  status.f_D_H_N = reading.f_D_H_N;
  return status;
}

void HapticServo::check_command(const HapticCommand& command, nanoseconds commanded,
                                nanoseconds now) noexcept {
  if (!command.f_D_H_N.allFinite()) latch({.fault = HapticFault::kBadCommand});
  if (now - commanded > limits_.command_timeout)
    latch({.fault = HapticFault::kNoCommand, .detail = whole_microseconds(now - commanded)});
}

/// Limited and faded in; not yet slowed down.
Vector3d HapticServo::shaped(const Vector3d& wanted_N, nanoseconds now, bool& saturated) const noexcept {
  const double limit_N = link_.info().force_limit_N;
  saturated = wanted_N.stableNorm() > limit_N;
  const double gain = limits_.ramp_in > 0ms
                          ? std::clamp(seconds(now - *enabled_since_) / seconds(limits_.ramp_in), 0.0, 1.0)
                          : 1.0;
  return gain * within(wanted_N, limit_N);
}

void HapticServo::check_reading(HapticStatus reading, const HapticSample& measured,
                                nanoseconds now) noexcept {
  if (reading.fault == HapticFault::kNotReady) return;
  if (!reading.ok()) latch(reading);
  if (!enabled_since_) return;
  if (now - fresh_ > limits_.stale_after)
    latch({.fault = HapticFault::kStale, .detail = whole_microseconds(now - fresh_)});
  const bool has_force = link_.info().force_limit_N > 0.0;  // a cap on springs may snap back
  if (has_force && measured.v_HD_H_m_per_s.norm() > limits_.speed_m_per_s)
    latch({.fault = HapticFault::kTooFast});
}

}  // namespace hal
