/// @file
/// Compares the velocity that a motor controller reports with the rate of its reported position.
#pragma once
#include "control/plausibility/sample_time.h"

namespace control {

/// Page's cumulative sum (Biometrika 41:100, 1954) of their difference beyond a tolerance: a share of the
/// speed, a bias, and a lag of the reported velocity, which is a filtered value. It detects a reading that is
/// scaled by 0.5 or 2, has the wrong sign, or is frozen; it does not detect both being wrong in the same way.
/// A sample taken later than its stamp adds to the sum what the next sample removes: of the sums that the
/// time bounds of the first and the last sample allow, the smallest one counts.
/// One thread. Cycle: update() and restart() neither allocate nor throw.
class VelocityAgreement {
 public:
  /// @param bias_rad_per_s tolerated permanent error of the velocity.
  explicit VelocityAgreement(double bias_rad_per_s) noexcept : bias_rad_per_s_(bias_rad_per_s) {}

  void restart() noexcept { known_ = false; }
  /// Call with each fresh sample. True: they disagree.
  bool update(double position_rad, double velocity_rad_per_s, const SampleTime& time) noexcept;

 private:
  double bias_rad_per_s_;
  bool known_ = false;
  double position_rad_ = 0.0;
  double velocity_rad_per_s_ = 0.0;
  double smooth_rate_rad_per_s_ = 0.0;
  double smooth_velocity_rad_per_s_ = 0.0;
  double trend_rad_per_s_ = 0.0;  // the rate, smoothed twice
  double above_rad_ = 0.0;        // sums of the difference in either direction, from the
  double below_rad_ = 0.0;        // sample at which they become largest
};

}  // namespace control
