#include "hal/loopback_haptic_link.h"

#include <utility>

#include "hal/setup_error.h"

namespace hal {

LoopbackHapticLink::LoopbackHapticLink(HandPlant& hand, std::chrono::nanoseconds period, HapticInfo info)
    : hand_(hand), period_(period), info_(std::move(info)) {
  if (period_.count() <= 0) throw SetupError(info_.name, "set the period", "it must be positive");
}

HapticStatus LoopbackHapticLink::exchange(const HapticCommand& command, std::chrono::nanoseconds now,
                                          HapticSample& sample) noexcept {
  if (!open_) return {HapticFault::kNotActive};
  HapticSample measured;
  measured.stamp = now;
  hand_.measure(measured);
  // As in drivers of real devices, a bad measurement removes the force in the same exchange.
  const bool good = measured.p_HD_m.allFinite() && measured.q_HD.coeffs().allFinite();
  HapticStatus status;
  if (command.enable && good) status.f_D_H_N = command.f_D_H_N;
  hand_.advance(status.f_D_H_N, period_);
  if (good) {
    sample = measured;
  } else {
    status.fault = HapticFault::kBadSample;
  }
  return status;
}

}  // namespace hal
