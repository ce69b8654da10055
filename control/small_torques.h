/// @file
/// Torques that an actuator cannot deliver, on average.
#pragma once
#include <cmath>

namespace control {

/// For an actuator that delivers its least torque T for every smaller command but zero (the youBot's 0.03
/// N·m, thesis 2.5.2): a torque below T becomes pulses of T, zero between, whose mean is the torque wanted.
/// What is not delivered yet is carried over and stays within T/2. A T estimated too large only makes the
/// pulses rarer and higher, as they are delivered as commanded; with one too small the mean is too large, by
/// no more than the factor of the true T over it. One actuator each. Cycle: step().
class SmallTorques {
 public:
  SmallTorques() = default;
  explicit SmallTorques(double least_torque_Nm) noexcept : least_Nm_(least_torque_Nm) {}

  void reset() noexcept { owed_Nm_ = 0; }
  double step(double wanted_Nm) noexcept {
    // Not a number goes on as it is: whoever takes commands refuses it.
    if (wanted_Nm == 0 || !(std::abs(wanted_Nm) < least_Nm_)) {
      reset();
      return wanted_Nm;
    }
    owed_Nm_ += wanted_Nm;
    if (std::abs(owed_Nm_) < 0.5 * least_Nm_) return 0;
    const double pulse_Nm = std::copysign(least_Nm_, owed_Nm_);
    owed_Nm_ -= pulse_Nm;
    return pulse_Nm;
  }

 private:
  double least_Nm_ = 0;
  double owed_Nm_ = 0;
};

}  // namespace control
