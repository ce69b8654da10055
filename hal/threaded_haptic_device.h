/// @file
/// hal::HapticDevice with a transport thread, for devices with blocking calls.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>

#include "hal/haptic_servo.h"

namespace hal {

struct HapticThreadOptions {
  std::chrono::nanoseconds period = std::chrono::milliseconds(1);  ///< of the exchanges with the device
  int fifo_priority = 0;  ///< SCHED_FIFO, 1 to 99; 0: inherit the scheduling of the activating thread
  std::chrono::nanoseconds patience = std::chrono::seconds(2);  ///< time-out of deactivate() for a device
                                                                ///< call
};

/// The thread runs the servo at the device's rate, always with the newest command, and publishes each
/// outcome; exchange() passes commands and outcomes, both wait-free. Time is CLOCK_MONOTONIC.
///
/// A fault, and its end, appears one device exchange later than it happened; zero force is not delayed. If
/// the loop stops giving commands, the force ends (kNoCommand). If a device call does not return in time,
/// exchange() returns kStale, and the force stays off until disabled once, even if the call returns later;
/// until then only the device's own watchdog can end the force.
class ThreadedHapticDevice final : public HapticDevice {
 public:
  /// @throws hal::SetupError if the limits or the options are invalid.
  explicit ThreadedHapticDevice(std::unique_ptr<HapticLink> link, const HapticLimits& limits = {},
                                const HapticThreadOptions& options = {});
  ~ThreadedHapticDevice() override { deactivate(); }

  const HapticInfo& info() const noexcept override;
  /// @throws hal::SetupError also if the priority is refused, or if a call of an earlier activation has still
  /// not returned.
  void activate() override;
  /// Waits for the thread for at most `patience`; false also if it is stuck in a device call.
  bool deactivate() noexcept override;
  HapticStatus exchange(const HapticCommand& command, HapticSample& sample) noexcept override;
  std::string describe(const HapticStatus& status) const override;

 private:
  struct Shared;  // shared with the thread, which may outlive the device if it is stuck

  HapticLimits limits_;
  HapticThreadOptions options_;
  std::shared_ptr<Shared> shared_;
  bool running_ = false;
  bool stuck_ = false;
  std::uint32_t disables_ = 0;
  HapticStatus status_;
  HapticSample sample_;
  std::chrono::nanoseconds updated_{};  // time of the last status_ from the thread
  bool silent_ = false;                 // no update within the limit; latched until disabled
  bool force_off_ = true;               // as reported when the thread ended last
};

}  // namespace hal
