/// @file
/// Creates the haptic device for `--haptic NAME`.
#pragma once
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "drivers/haptic/falcon.h"
#include "hal/clock.h"
#include "hal/haptic/force_dimension_link.h"
#include "hal/haptic/space_mouse_link.h"
#include "hal/haptic_device.h"
#include "hal/haptic_servo.h"
#include "hal/threaded_haptic_device.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/station/link_options.h"
#include "sim/hand.h"

namespace runtime {

/// Not for users: with role = "robot" the haptic device is the one of the operator's station.
inline constexpr const char* kRemoteHaptic = "the operator's station";

struct HapticOptions {
  std::string name = "loopback";
  double force_limit_N = 8.0;
  hal::HapticLimits limits;
  hal::HapticThreadOptions thread{.fifo_priority =
                                      85};  ///< above the robot's loop, so that the force is not delayed
  hal::ForceDimensionLinkConfig force_dimension;
  struct Falcon {
    std::filesystem::path firmware;  ///< the user's image; empty: the device must already be running
    std::string port_path;           ///< "1-1.2"; empty: the first one found
    drivers::haptic::FalconConfig device;
  } falcon;
  hal::SpaceMouseLinkConfig space_mouse;
  sim::HandParameters hand;  ///< of the loopback
  LinkOptions link;          ///< of the operator's station
};

/// Applies the content of the `[haptic]` table of a configuration; drivers/haptic/README.md shows every key.
/// Relative paths start at `folder`.
void read_haptic(TomlTable& table, const std::filesystem::path& folder, HapticOptions& options);

/// Raises the pause that a simulated handle tolerates to 0.1 s, unless `stale_after` differs from its
/// default. Only without a real device: then nothing moves and no force acts.
void bear_pauses(HapticOptions& options);

struct OpenedHaptic {
  std::unique_ptr<sim::Hand> hand;  ///< of the loopback; otherwise null
  std::unique_ptr<hal::HapticDevice> device;
  std::shared_ptr<LinkMonitor> link;  ///< of the operator's station; otherwise null
};

/// - `loopback`: a simulated hand on a simulated handle, in lock-step with the caller's `period`.
/// - `force-dimension` or `omega.6`: an omega.6 through the vendor's library, which is `force_dimension.sdk`,
///   else the one in $FDSDK, else the loader's. No sample is older than its watchdog's time (20 ms).
/// - `falcon`: a Novint Falcon over USB, started with `falcon.firmware` after each power-on.
/// - `spacemouse`: a 3Dconnexion SpaceMouse, without force.
/// - kRemoteHaptic: the device of the operator's station, over the link. No sample is older than its silence.
/// All but the first have a thread of their own, run in real time, and fade the force in over 1 s or more.
/// `clock` outlives the result. Nothing is opened before HapticDevice::activate().
/// @throws std::invalid_argument for an unknown name, listing the known ones; hal::SetupError when the
///         firmware file cannot be read, or drivers::SetupError the key of the link.
OpenedHaptic open_haptic(const HapticOptions& options, const hal::Clock& clock,
                         std::chrono::nanoseconds period);

/// Whether such a device can run in virtual time.
bool is_simulated_haptic(const std::string& name);
/// Whether it is a device of the vendor's library.
bool is_force_dimension(const std::string& name);

}  // namespace runtime
