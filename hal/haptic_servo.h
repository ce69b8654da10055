/// @file
/// Between a loop that gives forces and a device that makes them: the only owner of force limit, slew, ramp,
/// staleness and latched faults, the same for every haptic device.
#pragma once
#include <Eigen/Core>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "hal/haptic_link.h"
#include "hal/velocity_filter.h"

namespace hal {

struct HapticLimits {
  double slew_N_per_s = 200.0;  ///< the force changes no faster while it is on; it ends at once
  double speed_m_per_s = 1.0;   ///< a faster handle loses its force
  /// The gain goes from 0 to 1 after each enabling, and each time the device could make no force: it had no
  /// position, it was settling, or its position was too old. 0: at once.
  std::chrono::milliseconds ramp_in{1000};
  /// Older samples, and longer pauses between two exchanges, end the force. No less than the device's period;
  /// more than 0.1 s only for a device behind a network.
  std::chrono::milliseconds stale_after{20};
  std::chrono::milliseconds command_timeout{20};  ///< older commands end the force
  double velocity_cutoff_Hz = VelocityFilter::kDefaultCutoff_Hz;

  /// Setup: everything that is wrong with it, in words.
  std::vector<std::string> problems() const;
};

/// One thread. Cycle: step(); nothing here allocates, locks or throws.
class HapticServo {
 public:
  /// `link` outlives the servo. @throws hal::SetupError listing all HapticLimits::problems().
  HapticServo(HapticLink& link, const HapticLimits& limits);

  /// The link was opened again: no force, no fault, no sample.
  void reset() noexcept;

  /// One exchange with the device. `commanded` is when the command was given, in the clock of `now`. The
  /// first fault is kept, with zero force, until a command that is not enabled. `sample` as in
  /// HapticDevice::exchange().
  HapticStatus step(const HapticCommand& command, std::chrono::nanoseconds commanded,
                    std::chrono::nanoseconds now, HapticSample& sample) noexcept;

 private:
  void check_command(const HapticCommand& command, std::chrono::nanoseconds commanded,
                     std::chrono::nanoseconds now) noexcept;
  Eigen::Vector3d shaped(const Eigen::Vector3d& wanted_N, std::chrono::nanoseconds now,
                         bool& saturated) const noexcept;
  void check_reading(HapticStatus reading, const HapticSample& measured,
                     std::chrono::nanoseconds now) noexcept;
  void latch(HapticStatus status) noexcept {
    if (latched_.ok()) latched_ = status;
  }

  HapticLink& link_;
  HapticLimits limits_;
  VelocityFilter velocity_;
  HapticStatus latched_;
  std::optional<std::chrono::nanoseconds> previous_;       // step
  std::optional<std::chrono::nanoseconds> enabled_since_;  // empty: no force
  std::chrono::nanoseconds fresh_{};                       // latest new sample, or enabling
  bool has_sample_ = false;
  std::chrono::nanoseconds stamp_{};  // of the latest sample
  Eigen::Vector3d sent_N_ = Eigen::Vector3d::Zero();
};

}  // namespace hal
