/// @file
/// A 3Dconnexion SpaceMouse: a cap that is pushed and turned in six directions, and buttons. It cannot push
/// back; what it is good for is to steer by rate.
///
///   SpaceMouse mouse;                          // or SpaceMouse mouse({.serial = "..."})
///   while (...) status = mouse.poll(now, sample);
///
/// A device at rest is silent, so silence is no fault: a lost device is known by the error of a read. One
/// that falls silent while deflected counts as released (space_mouse_report.h).
///
/// hidapi's hidraw backend (0.13) reads by one poll(), and one read() into our buffer when there is
/// something. It allocates nothing, but for the text of an error, which is once, when the device goes. Writes
/// wait for the device, up to seconds: so the light is switched when opening and closing only.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/haptic/space_mouse_report.h"
#include "drivers/haptic/space_mouse_setup.h"

namespace drivers::haptic {

struct SpaceMouseSample {
  std::chrono::nanoseconds stamp{};  ///< the `now` of the poll that filled it
  SpaceMouseDeflection deflection{};
  std::uint32_t buttons = 0;  ///< bit 0 is the first, on the left
  std::optional<int> battery_percent;
};

enum class SpaceMouseFault : std::uint8_t {
  kNone,
  kUnplugged,  ///< latched; only a new SpaceMouse brings it back
};
const char* describe(SpaceMouseFault fault) noexcept;

struct [[nodiscard]] SpaceMouseStatus {
  SpaceMouseFault fault = SpaceMouseFault::kNone;
  int reports = 0;  ///< taken in this poll
  /// So many had piled up that the kernel dropped the newest: the cap counts as released until it reports
  /// again. Not a fault; nobody had polled for half a second or more.
  bool overrun = false;
  bool ok() const noexcept { return fault == SpaceMouseFault::kNone; }
};

/// One device, opened. Others may have it open, too: each gets all reports. One thread at a time.
class SpaceMouse {
 public:
  /// Setup: finds it, opens it, switches its light on. @throws SetupError when there is none or it may not be
  /// opened, with what to do.
  explicit SpaceMouse(const SpaceMouseChoice& choice = {});
  SpaceMouse(const SpaceMouse&) = delete;
  SpaceMouse& operator=(const SpaceMouse&) = delete;
  /// Setup: switches the light off; whether that worked is not told.
  ~SpaceMouse();

  const SpaceMouseInfo& info() const noexcept { return info_; }

  /// Cycle: takes all reports that have come, at most kMaxReports, and never waits. `now`: any steady clock.
  /// With a fault the sample's deflection and buttons are zero, since nobody holds the cap, and its stamp
  /// stays.
  SpaceMouseStatus poll(std::chrono::nanoseconds now, SpaceMouseSample& sample) noexcept;

  /// Since opening: reports that were none of a SpaceMouse's, or cut short.
  std::uint64_t unknown_reports() const noexcept { return reports_.unknown_reports(); }

  /// hidraw keeps 64 places of which one stays free, and drops what comes when they are full (Linux,
  /// drivers/hid/hidraw.c).
  static constexpr int kKernelQueue = 63;
  /// More than there can be, unless the device sends faster than we read.
  static constexpr int kMaxReports = 128;

 private:
  HidapiUse hidapi_;  // outlives device_
  SpaceMouseInfo info_;
  HidDevice device_;
  SpaceMouseReports reports_;
  bool unplugged_ = false;
};

}  // namespace drivers::haptic
