/// @file
/// Compares the velocity that a motor controller reports with the change of the position that it reports.
#pragma once
#include "control/plausibility/sample_time.h"

namespace control {

/// Page's cumulative sum (Biometrika 41:100, 1954) of their difference beyond what may be: a share of the
/// speed, a bias, and a lag of the reported velocity, which is a filtered value. Scaled by 0.5 or 2, with the
/// wrong sign or frozen, either reading is found; both wrong in the same way are not. A sample taken later
/// than its stamp says adds to the sum what the next one takes away: a sum counts from the sample and to the
/// sample, within the bounds of both, with which it is least.
/// One thread. Cycle: update() and restart() neither allocate nor throw.
class VelocityAgreement {
 public:
  /// @param bias_rad_per_s by which the velocity may be wrong for ever.
  explicit VelocityAgreement(double bias_rad_per_s) noexcept : bias_rad_per_s_(bias_rad_per_s) {}

  void restart() noexcept { known_ = false; }
  /// With each fresh sample. True: they disagree.
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
  double below_rad_ = 0.0;        // sample on with which they are largest
};

}  // namespace control
