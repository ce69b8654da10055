#include "hal/lockstep_haptic_device.h"

#include <utility>

namespace hal {

LockstepHapticDevice::LockstepHapticDevice(std::unique_ptr<HapticLink> link, const Clock& clock,
                                           const HapticLimits& limits)
    : link_(std::move(link)), clock_(clock), servo_(*link_, limits) {}

void LockstepHapticDevice::activate() {
  deactivate();
  link_->open();
  servo_.reset();
  active_ = true;
}

bool LockstepHapticDevice::deactivate() noexcept {
  active_ = false;
  return link_->close();
}

HapticStatus LockstepHapticDevice::exchange(const HapticCommand& command, HapticSample& sample) noexcept {
  if (!active_) return {HapticFault::kNotActive};
  const std::chrono::nanoseconds now = clock_.now();
  return servo_.step(command, now, now, sample);
}

}  // namespace hal
