/// @file
/// Proves that a joint has exceeded its speed limit although the times of its samples are known only within
/// bounds.
#pragma once
#include <algorithm>
#include <cmath>

namespace control {

/// Guaranteed bounds of the time of a sample (hal::RobotSample), on one clock.
struct SampleBounds {
  double earliest_s = 0.0;
  double latest_s = 0.0;
};

/// A joint within its speed limit L needs at least (p_j - p_i)/L between any two samples. With
///   t_j = max(earliest_j, t_i + (p_j - p_i)/L)
/// each sample gets the earliest time that all samples before it allow. If t_j is later than latest_j, no
/// sample times within the bounds allow this motion at L; otherwise some do. The same holds in the negative
/// direction.
/// Cycle: all but construction.
class SpeedProof {
 public:
  SpeedProof() = default;
  explicit SpeedProof(double limit_rad_per_s) : limit_rad_per_s_(limit_rad_per_s) {}

  /// Forgets earlier samples: the origin of the angles has changed.
  void restart() noexcept { known_ = false; }
  /// For each new sample.
  void update(double position_rad, const SampleBounds& taken) noexcept {
    const double least_s = known_ ? (position_rad - position_rad_) / limit_rad_per_s_ : 0.0;
    forward_s_ = known_ ? std::max(taken.earliest_s, forward_s_ + least_s) : taken.earliest_s;
    backward_s_ = known_ ? std::max(taken.earliest_s, backward_s_ - least_s) : taken.earliest_s;
    position_rad_ = position_rad;
    latest_s_ = taken.latest_s;
    known_ = true;
  }
  bool too_fast() const noexcept { return forward_s_ > latest_s_ || backward_s_ > latest_s_; }

 private:
  double limit_rad_per_s_ = 1.0;
  bool known_ = false;
  double position_rad_ = 0.0;
  double forward_s_ = 0.0;   // t of the last sample
  double backward_s_ = 0.0;  // likewise
  double latest_s_ = 0.0;
};

/// A filtered velocity is wrong if the time of a sample is, so an excess must be proven. NaN counts as too
/// fast.
inline bool is_too_fast(double filtered_rad_per_s, double limit_rad_per_s, const SpeedProof& proof) noexcept {
  if (std::abs(filtered_rad_per_s) <= limit_rad_per_s) return false;
  return std::isnan(filtered_rad_per_s) || proof.too_fast();
}

}  // namespace control
