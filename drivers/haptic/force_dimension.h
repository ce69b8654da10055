/// @file
/// An omega.6 through the vendor's SDK: pose in, force out, once a cycle.
///
///   const ForceDimensionLibrary library(sdk_search_from_environment());
///   ForceDimension device(library, {.max_force_N = 6.0});          // opened, brakes on
///   loop: status = device.exchange({.enable = clutch, .f_D_H_N = force}, now, sample);
///   device.stop();
///
/// Frames as in device_exchange.h. The wrist senses and has no motors. Time is the caller's: any monotonic
/// clock that goes on between two exchanges.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/haptic/device_exchange.h"
#include "drivers/haptic/force_dimension_setup.h"

namespace drivers::haptic {

struct ForceDimensionCommand {
  /// Level, not event: false is zero force.
  bool enable = false;
  Vector3 f_D_H_N{};  ///< scaled down to the limit when larger
};

/// "the device switched its force off: the watchdog: no force command came in time". The detail of kForceOff
/// is the cause (describe_force_off()), of kUnplugged and kDeviceFault the SDK's error. Allocates.
std::string describe_force_dimension(HapticFault fault, std::int32_t detail);

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

  /// Cycle: reads pose, buttons and state, then sends a force. While the force is on each call sends one,
  /// also zero: gravity compensation and the watchdog need it. Enabling switches the force on and withholds
  /// it for config.settle, in which the device may still show its brakes. After a fault of the device the
  /// force is off until an exchange with `enable` false; kUnplugged, which leaves the device's limits
  /// unknown, ends with a new ForceDimension only. Any other fault is zero force in its cycle. `sample` is
  /// unchanged when nothing new or nothing good came; the SDK's time guard may repeat a pose. Neither
  /// allocates nor locks by itself; the SDK may.
  DeviceStatus exchange(const ForceDimensionCommand& command, std::chrono::nanoseconds now,
                        DeviceSample& sample) noexcept;

  /// Ramps the force to zero over 20 ms, or drops it after a fault, switches it off and closes the device.
  /// Allowed in any state, blocks for some 30 ms. False when the device never confirmed its stop: only its
  /// watchdog can end the force then.
  bool stop() noexcept;

 private:
  ForceDimension(const ForceDimensionLibrary& library, const ForceDimensionConfig& config, char id);

  /// Faults first; `measured` is good when the status is fresh.
  DeviceStatus read(std::chrono::nanoseconds now, DeviceSample& measured) noexcept;
  int read_pose(DeviceSample& measured) noexcept;
  std::uint32_t read_buttons() noexcept;
  DeviceStatus check_state(std::chrono::nanoseconds now) const noexcept;
  bool settling(std::chrono::nanoseconds now) const noexcept;
  bool switch_force_on(std::chrono::nanoseconds now) noexcept;
  DeviceStatus give_up_force(DeviceStatus status) noexcept;
  int send(const Vector3& f_N) noexcept;
  DeviceStatus sdk_fault() const noexcept;

  SdkFunctions f_;
  ForceDimensionConfig config_;
  int id_ = -1;  ///< -1: closed
  ForceDimensionInfo info_;

  /// When we switched the force on; empty: it is off, as the SDK confirmed.
  std::optional<std::chrono::nanoseconds> force_on_since_;
  DeviceStatus given_up_;  // the fault of the device since enabling
  Vector3 sent_N_{};
};

}  // namespace drivers::haptic
