/// @file
/// hal::HapticLink over a SpaceMouse: a master that steers by rate and feels nothing.
#pragma once
#include <memory>
#include <optional>

#include "drivers/haptic/space_mouse.h"
#include "hal/haptic_link.h"

namespace hal {

struct SpaceMouseLinkConfig {
  drivers::haptic::SpaceMouseChoice choice = {};
  /// What the cap's stop stands for: as if a grip on a spring had been moved that far. What runs with a real
  /// grip then runs with the cap, too.
  double travel_m = 0.05;  ///< above 0, up to 1
  double turn_rad = 0.5;   ///< above 0, up to 3
};

/// The cap's axes (x right, y away from the user, z up) become those of hal/haptic_sample.h; its rotation is
/// a rotation vector. It cannot push: the force limit is zero, and every force saturates. A cap at rest is
/// silent and its sample fresh all the same.
class SpaceMouseLink final : public HapticLink {
 public:
  /// @throws hal::SetupError when the configuration makes no sense.
  explicit SpaceMouseLink(SpaceMouseLinkConfig config);

  const HapticInfo& info() const noexcept override { return info_; }
  void open() override;
  bool close() noexcept override;
  HapticStatus exchange(const HapticCommand& command, std::chrono::nanoseconds now,
                        HapticSample& sample) noexcept override;

 private:
  SpaceMouseLinkConfig config_;
  HapticInfo info_;
  std::optional<drivers::haptic::SpaceMouse> mouse_;
};

}  // namespace hal
