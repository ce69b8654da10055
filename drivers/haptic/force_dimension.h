/// @file
/// An omega.6 through the vendor's SDK: pose in, force out, once a cycle.
///
///   const ForceDimensionLibrary library(sdk_search_from_environment());
///   ForceDimension device(library, {.max_force_N = 6.0});          // opened, brakes on
///   loop: status = device.exchange({.enable = clutch, .f_D_H_N = force}, now, sample);
///   device.stop();
///
/// Frames: H is the device's fixed base (x towards the operator, y to the operator's right, z up), D its
/// grip. Forces act on the hand. The wrist senses and has no motors. Time is the caller's: any monotonic
/// clock that goes on between two exchanges; while it stands still nothing is late and nothing is stale.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/haptic/force_dimension_setup.h"

namespace drivers::haptic {

struct ForceDimensionSample {
  std::chrono::nanoseconds stamp{};  ///< the `now` of the exchange that read it
  std::array<double, 3> p_HD_m{};
  std::array<std::array<double, 3>, 3> R_HD{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< by rows
  std::uint32_t buttons = 0;  ///< bit i: button i is down; the omega.6 has button 0
};

struct ForceDimensionCommand {
  /// Level, not event: false is zero force and forgets a fault, but for kUnplugged. From each rise on the
  /// force is zero for `settle`, then the gain goes from 0 to 1 over `ramp_in`.
  bool enable = false;
  std::array<double, 3> f_D_H_N{};  ///< scaled down to the limit when larger
};

enum class ForceDimensionFault : std::uint8_t {
  kNone,
  kNotOpen,
  kBadCommand,  ///< a force was not finite
  kBadSample,   ///< a measured value was not finite
  kLate,        ///< more than half the watchdog's time since the exchange before; detail: the gap in us
  kStale,       ///< no new pose for longer than the watchdog's time, force on; detail: the pose's age in us
  kForceOff,    ///< the device switched its force off; detail: see describe_force_off()
  /// The device does not answer, lost its power or its calibration, or reports an error; detail: the SDK's
  /// error. Nobody knows then which of its limits are left, so this ends with a new ForceDimension only.
  kUnplugged,
  kSdkError,  ///< detail: see describe_sdk_error()
};

struct [[nodiscard]] ForceDimensionStatus {
  ForceDimensionFault fault = ForceDimensionFault::kNone;
  bool saturated = false;  ///< the force was scaled down, here or by the device; not a fault
  bool repeated = false;   ///< the time guard gave the old pose: `sample` is as it was; not a fault
  std::int32_t detail = 0;
  std::array<double, 3> f_D_H_N{};  ///< the latest force that the SDK took, zero once it stopped the device
  bool ok() const noexcept { return fault == ForceDimensionFault::kNone; }
};
/// "the device switched its force off: the watchdog: no force command came in time". Allocates.
std::string describe(const ForceDimensionStatus& status);

/// Sole owner of its device. One thread calls exchange(); other calls never run beside it.
class ForceDimension {
 public:
  /// Setup: open, calibrated, watchdog and limits set. The force stays off, brakes on, until the first
  /// exchange that enables it, since the watchdog runs from then on. May take seconds, and moves the handle
  /// when config.allow_motion is set. @throws SetupError naming the device, the step and what to do.
  ForceDimension(const ForceDimensionLibrary& library, const ForceDimensionConfig& config);
  ForceDimension(const ForceDimension&) = delete;
  ForceDimension& operator=(const ForceDimension&) = delete;
  /// As stop().
  ~ForceDimension();

  const ForceDimensionInfo& info() const noexcept { return info_; }

  /// Cycle: reads pose, buttons and state, then sends a force. While the force is on each call sends one, be
  /// it zero: gravity compensation and the watchdog live on that. The first fault is kept, and the force is
  /// zero, until an exchange with enable false; a force that the device switched off, or that it refused,
  /// comes back only by enabling after that. `sample` is left untouched when nothing new or nothing good
  /// came, so that its stamp shows its age. Neither allocates nor locks by itself; what the SDK does in its
  /// calls is its own.
  ForceDimensionStatus exchange(const ForceDimensionCommand& command, std::chrono::nanoseconds now,
                                ForceDimensionSample& sample) noexcept;

  /// Ramps the force to zero over 20 ms, or drops it after a fault, switches it off and closes the device.
  /// Allowed in any state, blocks for some 30 ms. False when the device never confirmed to have stopped: its
  /// watchdog is what is left.
  bool stop() noexcept;

 private:
  ForceDimension(const ForceDimensionLibrary& library, const ForceDimensionConfig& config, char id);

  /// What this cycle found, faults first; `measured` is good when there are none.
  ForceDimensionStatus read(std::chrono::nanoseconds now, ForceDimensionSample& measured) noexcept;
  int read_pose(ForceDimensionSample& measured) noexcept;
  std::uint32_t read_buttons() noexcept;
  ForceDimensionStatus check_state(std::chrono::nanoseconds now) const noexcept;
  ForceDimensionStatus switch_force_on(std::chrono::nanoseconds now) noexcept;
  void give_up_force() noexcept;
  ForceDimensionStatus send(const std::array<double, 3>& f_N) noexcept;
  ForceDimensionStatus sdk_fault() const noexcept;
  void latch(const ForceDimensionStatus& status) noexcept;
  double gain(std::chrono::nanoseconds now) const noexcept;

  SdkFunctions f_;
  ForceDimensionConfig config_;
  int id_ = -1;  ///< -1: closed
  ForceDimensionInfo info_;

  /// When we switched the force on; empty: it is off, as the SDK confirmed.
  std::optional<std::chrono::nanoseconds> force_on_since_;
  ForceDimensionStatus latched_;
  std::optional<std::chrono::nanoseconds> previous_;
  std::optional<std::chrono::nanoseconds> enabled_since_;
  std::chrono::nanoseconds fresh_{};  // the latest new pose since enabling, or enabling itself
  std::array<double, 3> sent_N_{};
};

}  // namespace drivers::haptic
