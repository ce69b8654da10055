/// @file
/// Dead-band compensation by pulse modulation.
#pragma once
#include <cmath>

namespace control {

/// For an actuator that delivers its minimum torque T for every smaller non-zero command (0.03 N·m on the
/// youBot, thesis 2.5.2): a torque below T becomes pulses of T, zero between, whose mean is the wanted
/// torque. The undelivered remainder is carried over and stays within T/2. If T is overestimated, the pulses
/// are only rarer and higher, since they are delivered as commanded; if T is underestimated, the mean is too
/// large by at most the ratio of the true T to the estimate. One instance per actuator. Cycle: step().
class DeadbandModulator {
 public:
  DeadbandModulator() = default;
  explicit DeadbandModulator(double least_torque_Nm) noexcept : least_Nm_(least_torque_Nm) {}

  void reset() noexcept { owed_Nm_ = 0; }
  double step(double wanted_Nm) noexcept {
    // NaN is passed through; the HAL rejects it.
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
