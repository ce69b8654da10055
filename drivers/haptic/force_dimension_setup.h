/// @file
/// Set-up of an omega.6: opened, calibrated and limited, its force off. Everything here blocks, allocates and
/// throws SetupError; ForceDimension (force_dimension.h) is what calls it.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "drivers/haptic/force_dimension_library.h"

namespace drivers::haptic {

inline constexpr double kOmega6MaxForce_N = 12.0;  ///< what drivers in use set (chai3d and others)

/// Waits at least so long; used while stopping, never in a cycle.
using WaitFor = std::function<void(std::chrono::nanoseconds)>;
void sleep_for(std::chrono::nanoseconds time);
/// For stopping a device, which goes on when `wait` throws, only faster.
void wait_without_throwing(const WaitFor& wait, std::chrono::nanoseconds time) noexcept;

/// Attempts to stop the device, with a pause after each refusal.
inline constexpr int kStopAttempts = 5;
inline constexpr std::chrono::milliseconds kStopRetry{2};

struct ForceDimensionConfig {
  // Which device: by serial number, else by number, else the first omega.6.
  std::optional<std::uint16_t> serial;
  std::optional<std::uint8_t> index;

  /// Calibration moves the handle: false refuses a device that is not calibrated.
  bool allow_motion = false;
  /// Without a force command for so long the firmware switches the force off. 125 us to 31.875 ms, rounded
  /// down to 125 us.
  std::chrono::microseconds watchdog{20'000};
  double max_force_N = 8.0;  ///< above 0, up to kOmega6MaxForce_N
  /// At the handle, for gravity compensation, 0 to 1 kg; empty: what the device has stored.
  std::optional<double> effector_mass_kg;
  /// A read sooner than this after another one returns the old sample. 0 to 10 ms; empty: the SDK's. A loop
  /// of 4 kHz needs 0; more than hal::HapticLimits::stale_after makes each sample stale.
  std::optional<std::chrono::microseconds> time_guard;
  /// Zero force from switching it on, while the device may still show its brakes; 20 ms to 10 s. No shorter
  /// than hal::HapticLimits::stale_after, so that a pose that stands still is stale before there is a force.
  std::chrono::milliseconds settle{100};
  WaitFor wait = sleep_for;

  /// All that is wrong with it; empty: nothing.
  std::vector<std::string> problems() const;
  int watchdog_ticks() const noexcept;
};

struct ForceDimensionInfo {
  std::string name;  ///< "omega.6, right-handed (serial 4711)"
  int type = 0;
  bool left_handed = false;
  std::optional<std::uint16_t> serial;
  std::optional<double> firmware;
  int watchdog_ticks = 0;                           ///< 0: the firmware has no watchdog
  std::optional<std::uint32_t> velocity_threshold;  ///< the device's unit; read and never written
  double force_limit_N = 0.0;
  SdkVersion sdk;
  /// What an operator should know: a missing watchdog, missing symbols, a wrist that is not calibrated.
  std::vector<std::string> warnings;
};

/// The id. @throws SetupError when the configuration is wrong, no omega.6 is there, or another program has
/// it.
char open_force_dimension(const ForceDimensionLibrary& library, const ForceDimensionConfig& config);
/// By libdrd when it was handed the device.
void close_force_dimension(const SdkFunctions& functions, char id) noexcept;
/// What comes between opening and the first force. Leaves the brakes on. @throws SetupError.
ForceDimensionInfo prepare_force_dimension(const ForceDimensionLibrary& library, char id,
                                           const ForceDimensionConfig& config);

}  // namespace drivers::haptic
