#include "hal/loopback_haptic_device.h"

#include <utility>

#include "hal/setup_error.h"

namespace hal {
namespace {

bool finite(const HapticSample& sample) noexcept {
  return sample.p_HD_m.allFinite() && sample.v_HD_H_m_per_s.allFinite() && sample.q_HD.coeffs().allFinite();
}

}  // namespace

LoopbackHapticDevice::LoopbackHapticDevice(HandPlant& hand, const Clock& clock,
                                           std::chrono::nanoseconds period, HapticInfo info)
    : hand_(hand), clock_(clock), period_(period), info_(std::move(info)) {
  if (period_.count() <= 0) throw SetupError(info_.name, "set the period", "it must be positive");
}

void LoopbackHapticDevice::activate() {
  active_ = true;
  latched_ = {};
}

HapticStatus LoopbackHapticDevice::exchange(const HapticCommand& command, HapticSample& sample) noexcept {
  if (!active_) return {HapticFault::kNotActive};

  HapticSample measured;
  measured.stamp = clock_.now();
  hand_.measure(measured);

  if (!command.enable) latched_ = {};
  const bool good_sample = finite(measured);
  if (latched_.ok() && !good_sample) latched_ = {HapticFault::kBadSample};
  if (latched_.ok() && !command.f_D_H_N.allFinite()) latched_ = {HapticFault::kBadCommand};

  HapticStatus status = latched_;
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
  if (command.enable && latched_.ok()) {
    force_N = command.f_D_H_N;
    const double magnitude_N = force_N.stableNorm();
    if (magnitude_N > info_.force_limit_N) {
      force_N *= info_.force_limit_N / magnitude_N;
      status.saturated = true;
    }
  }
  hand_.advance(force_N, period_);
  if (good_sample) sample = measured;
  return status;
}

}  // namespace hal
