/// @file
/// hal::HapticDevice without a thread: each exchange() performs one exchange with the device.
#pragma once
#include <memory>

#include "hal/clock.h"
#include "hal/haptic_servo.h"

namespace hal {

/// For virtual time, and for devices that do not block.
class LockstepHapticDevice final : public HapticDevice {
 public:
  /// `clock` must outlive the device. @throws hal::SetupError if the limits are invalid.
  LockstepHapticDevice(std::unique_ptr<HapticLink> link, const Clock& clock, const HapticLimits& limits = {});
  ~LockstepHapticDevice() override { deactivate(); }

  const HapticInfo& info() const noexcept override { return link_->info(); }
  void activate() override;
  bool deactivate() noexcept override;
  HapticStatus exchange(const HapticCommand& command, HapticSample& sample) noexcept override;
  std::string describe(const HapticStatus& status) const override { return link_->describe(status); }

 private:
  std::unique_ptr<HapticLink> link_;
  const Clock& clock_;
  HapticServo servo_;
  bool active_ = false;
};

}  // namespace hal
