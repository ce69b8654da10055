/// @file
/// A simulated haptic device over a hal::HandPlant.
#pragma once
#include <chrono>

#include "hal/hand_plant.h"
#include "hal/haptic_link.h"

namespace hal {

/// Each exchange() measures, then advances by one period with the force applied.
class LoopbackHapticLink final : public HapticLink {
 public:
  /// `hand` must outlive the link. @throws hal::SetupError if the period is not positive.
  LoopbackHapticLink(HandPlant& hand, std::chrono::nanoseconds period, HapticInfo info);

  const HapticInfo& info() const noexcept override { return info_; }
  void open() override { open_ = true; }
  bool close() noexcept override {
    open_ = false;
    return true;
  }
  HapticStatus exchange(const HapticCommand& command, std::chrono::nanoseconds now,
                        HapticSample& sample) noexcept override;

 private:
  HandPlant& hand_;
  std::chrono::nanoseconds period_;
  HapticInfo info_;
  bool open_ = false;
};

}  // namespace hal
