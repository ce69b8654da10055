/// @file
/// Limits the rate of change of a joint torque.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

namespace control {

/// libfranka limits the torque of a joint to 1000 N·m/s (kMaxTorqueRate in franka/rate_limiting.h), at 12 N·m
/// for the joints with the smaller gears (Franka Research 3, "Limits", joints 5 to 7): zero to full torque in
/// 12 ms. A youBot joint gets a rate in the same proportion to the maximum torque of its motor and gear:
///   rate = 1000/12 1/s · τ_max,   206 N·m/s for a wheel of 2.47 N·m, 1307 N·m/s for arm-1 of 15.7 N·m
inline constexpr double kTorqueRate_per_s = 1000.0 / 12.0;

/// Cycle: all but construction.
class TorqueRate {
 public:
  TorqueRate() = default;  ///< no limit
  /// rate [N·m/s] and period [s], positive.
  TorqueRate(double rate_Nm_per_s, double period_s) : most_Nm_(rate_Nm_per_s * period_s) {}

  /// Torque to send in place of `wanted_Nm`. Non-finite values pass; the robot rejects them.
  double step(double wanted_Nm) noexcept {
    if (!std::isfinite(wanted_Nm)) return pass(wanted_Nm);
    const double sent_Nm = std::clamp(wanted_Nm, last_Nm_ - most_Nm_, last_Nm_ + most_Nm_);
    limited_ = sent_Nm != wanted_Nm;
    return last_Nm_ = sent_Nm;
  }
  /// For torques that must not be slowed down: braking, or the first one in torque mode.
  double pass(double torque_Nm) noexcept {
    limited_ = false;
    return last_Nm_ = torque_Nm;
  }
  bool limited() const noexcept { return limited_; }  ///< in the last step

 private:
  double most_Nm_ = std::numeric_limits<double>::infinity();
  double last_Nm_ = 0.0;
  bool limited_ = false;
};

}  // namespace control
