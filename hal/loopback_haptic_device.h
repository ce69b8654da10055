/// @file
/// hal::HapticDevice over a hal::HandPlant.
#pragma once
#include <chrono>

#include "hal/clock.h"
#include "hal/hand_plant.h"
#include "hal/haptic_device.h"

namespace hal {

/// Each exchange() measures, then lets one period pass with the force applied.
class LoopbackHapticDevice final : public HapticDevice {
 public:
  /// `hand` and `clock` outlive the device. @throws hal::SetupError when the period is not positive.
  LoopbackHapticDevice(HandPlant& hand, const Clock& clock, std::chrono::nanoseconds period, HapticInfo info);

  const HapticInfo& info() const noexcept override { return info_; }
  void activate() override;
  void deactivate() noexcept override { active_ = false; }
  HapticStatus exchange(const HapticCommand& command, HapticSample& sample) noexcept override;

 private:
  HandPlant& hand_;
  const Clock& clock_;
  std::chrono::nanoseconds period_;
  HapticInfo info_;
  bool active_ = false;
  HapticStatus latched_{};
};

}  // namespace hal
