#include "control/plausibility/away_from_target.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace control {
namespace {

constexpr double kTargetSmoothing_s = 0.005;
constexpr double kTargetEarlier_s = 0.02;
/// Closer to the target, a controller may hunt.
constexpr double kAtTarget_rad = 0.01;
/// Twice what an arm joint of the simulated robot sinks when its position controller takes over its weight.
constexpr double kAway_rad = 0.03;
/// Delay of the velocity controller.
constexpr double kDelay_s = 0.03;

}  // namespace

bool AwayFromTarget::update(const hal::JointCommand& command, double position_rad,
                            const SampleTime& time) noexcept {
  if (command.mode != hal::CommandMode::kPosition) {
    // The velocity at the change of mode is that of the motion before it.
    away_rad_ = 0.0;
  }
  passed_s_ += time.elapsed_s;
  if (time.unsure_s() > 0) return false;
  const double elapsed_s = std::exchange(passed_s_, 0.0);
  if (!known_ || elapsed_s > kComparable_s) {
    *this = {};
    known_ = true;
    last_rad_.fill(position_rad);
    position_rad_ = position_rad;
    return false;
  }
  // The median of the last three.
  const auto [low_rad, high_rad] = std::minmax(last_rad_[0], last_rad_[1]);
  const double median_rad = std::clamp(position_rad, low_rad, high_rad);
  last_rad_ = {last_rad_[1], position_rad};
  const double moved_rad = median_rad - std::exchange(position_rad_, median_rad);
  // Plain means at first, as in OpposedMotion.
  const auto blend = [&](double smoothing_s) {
    return elapsed_s / (std::min(known_s_, smoothing_s) + elapsed_s);
  };
  velocity_rad_per_s_ += blend(kTargetSmoothing_s) * (moved_rad / elapsed_s - velocity_rad_per_s_);
  earlier_rad_per_s_ += blend(kTargetEarlier_s) * (velocity_rad_per_s_ - earlier_rad_per_s_);
  known_s_ += elapsed_s;
  if (command.mode != hal::CommandMode::kPosition) return false;

  const double left_rad = command.target - position_rad_;
  if (std::abs(left_rad) < kAtTarget_rad) {
    away_rad_ = 0.0;
    return false;
  }
  const double receded_rad = left_rad > 0 ? -moved_rad : moved_rad;
  if (away_rad_ <= 0) began_rad_per_s_ = std::abs(velocity_rad_per_s_);
  const bool slows_down = std::abs(velocity_rad_per_s_) < std::abs(earlier_rad_per_s_);
  if (receded_rad < 0 || !slows_down) away_rad_ = std::max(0.0, away_rad_ + receded_rad);
  return away_rad_ > kAway_rad + kDelay_s * began_rad_per_s_;
}

}  // namespace control
