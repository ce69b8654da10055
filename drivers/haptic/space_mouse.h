/// @file
/// A 3Dconnexion SpaceMouse: a cap that is pushed and turned in six directions, and buttons. It has no motors
/// and steers by rate.
///
///   SpaceMouse mouse;                          // or SpaceMouse mouse({.serial = "..."})
///   while (...) status = mouse.poll(now, sample);
///
/// A device at rest is silent, so silence is no fault: an unplugged device shows as the error of a read. A
/// device that falls silent while deflected counts as released (space_mouse_report.h).
///
/// hidapi's hidraw backend (0.13) reads by one poll(), and one read() into our buffer when there is
/// something. It allocates only the text of an error, once, when the device goes. Writes wait for the device,
/// up to seconds: so the light changes at opening and closing only.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/haptic/haptic_fault.h"
#include "drivers/haptic/space_mouse_report.h"
#include "drivers/haptic/space_mouse_setup.h"

namespace drivers::haptic {

struct SpaceMouseSample {
  std::chrono::nanoseconds stamp{};  ///< the `now` of the poll that filled it
  SpaceMouseDeflection deflection{};
  std::uint32_t buttons = 0;  ///< bit 0 is the first, on the left
  std::optional<int> battery_percent;
};

struct [[nodiscard]] SpaceMouseStatus {
  HapticFault fault = HapticFault::kNone;  ///< or kUnplugged, until there is a new SpaceMouse
  int reports = 0;                         ///< taken in this poll
  /// The kernel's queue was full and dropped the newest: the cap counts as released until it reports again.
  /// Not a fault; the latest poll was half a second or more before.
  bool overrun = false;
  bool ok() const noexcept { return fault == HapticFault::kNone; }
};

/// One device, opened. Other programs may have it open, too: each gets all reports. One thread at a time.
class SpaceMouse {
 public:
  /// Setup: finds it, opens it, switches its light on. @throws SetupError when there is none or it may not be
  /// opened, with what to do.
  explicit SpaceMouse(const SpaceMouseChoice& choice = {});
  SpaceMouse(const SpaceMouse&) = delete;
  SpaceMouse& operator=(const SpaceMouse&) = delete;
  /// Setup: switches the light off, without reporting whether that worked.
  ~SpaceMouse();

  const SpaceMouseInfo& info() const noexcept { return info_; }

  /// Cycle: takes all reports that have come, at most kMaxReports, and never waits. `now`: any steady clock.
  /// With a fault the sample's deflection and buttons are zero, and its stamp stays.
  SpaceMouseStatus poll(std::chrono::nanoseconds now, SpaceMouseSample& sample) noexcept;

  /// Since opening: reports that no SpaceMouse sends, or that were cut short.
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
