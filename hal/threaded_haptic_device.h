/// @file
/// hal::HapticDevice with a transport thread, for devices that make one wait.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>

#include "hal/haptic_servo.h"

namespace hal {

struct HapticThreadOptions {
  std::chrono::nanoseconds period = std::chrono::milliseconds(1);  ///< of the exchanges with the device
  int fifo_priority = 0;  ///< SCHED_FIFO, 1 to 99; 0: the scheduling of the thread that activates
  std::chrono::nanoseconds patience = std::chrono::seconds(2);  ///< of deactivate(), with a device call
};

/// The thread runs the servo at the device's rhythm, always with the newest command, and publishes each
/// outcome; exchange() hands over one and takes the other, both wait-free. Time is CLOCK_MONOTONIC.
///
/// A fault shows one exchange with the device later than it happened, as does its end; zero force does not
/// wait for that. When the loop stops giving commands the force ends (kNoCommand). When a device call does
/// not return in time exchange() says kStale, and the force stays off until disabled once, should the call
/// return after all; until then the device's own watchdog is what ends it.
class ThreadedHapticDevice final : public HapticDevice {
 public:
  /// @throws hal::SetupError when the limits or the options make no sense.
  explicit ThreadedHapticDevice(std::unique_ptr<HapticLink> link, const HapticLimits& limits = {},
                                const HapticThreadOptions& options = {});
  ~ThreadedHapticDevice() override { deactivate(); }

  const HapticInfo& info() const noexcept override;
  /// @throws hal::SetupError also when the priority is refused, or when a call of an earlier activation still
  /// has not returned.
  void activate() override;
  /// Waits for the thread as long as its patience lasts; false also when it is stuck in a device call.
  bool deactivate() noexcept override;
  HapticStatus exchange(const HapticCommand& command, HapticSample& sample) noexcept override;
  std::string describe(const HapticStatus& status) const override;

 private:
  struct Shared;  // with the thread, which may outlive the device when it is stuck

  HapticLimits limits_;
  HapticThreadOptions options_;
  std::shared_ptr<Shared> shared_;
  bool running_ = false;
  bool stuck_ = false;
  std::uint32_t disables_ = 0;
  HapticStatus status_;
  HapticSample sample_;
  std::chrono::nanoseconds told_{};  // when the thread told status_
  bool silent_ = false;              // it has told nothing for too long, and nobody disabled since
  bool force_off_ = true;            // as the latest end told
};

}  // namespace hal
