/// @file
/// A 3Dconnexion SpaceMouse as seen by its host: its reports while a hand moves its cap, byte for byte, and
/// its light. Without an operating system: the user transports the bytes.
///
///   EmulatedSpaceMouse mouse({}, [](auto time) { return SpaceMouseCap{.translation = {0.5, 0, 0}}; });
///   for (const auto& report : mouse.advance(20ms)) carry(report.bytes);
///
/// Source: recordings of AndunHH/spacemouse from a SpaceNavigator and a SpaceMouse Wireless: descriptors,
/// reports, their rate, and the three rounds of zeros after a release. That the newer layout also ends with
/// three zeros, and the position of its buttons, is a guess.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace sim::devices {

/// Position of the cap, from -1 to 1, which are the stops; larger values mean the stop. Axes from the user's
/// point of view: x to the right, y away from the user, z up; rotations right-handed about them.
struct SpaceMouseCap {
  std::array<double, 3> translation{};
  std::array<double, 3> rotation{};
};
using SpaceMouseMotion = std::function<SpaceMouseCap(std::chrono::nanoseconds)>;

enum class SpaceMouseLayout : std::uint8_t {
  kTwoReports,  ///< 1 and 2 alternating, every 8 ms (SpaceNavigator, Compact, Pro)
  kOneReport,   ///< all axes in report 1, every 16 ms, and a battery (Wireless)
};

struct EmulatedSpaceMouseOptions {
  SpaceMouseLayout layout = SpaceMouseLayout::kTwoReports;
  bool pro_buttons = false;  ///< 32 of them instead of 2
};

struct SpaceMouseReport {
  std::chrono::nanoseconds at{};
  std::vector<std::uint8_t> bytes{};
};

class EmulatedSpaceMouse {
 public:
  EmulatedSpaceMouse(const EmulatedSpaceMouseOptions& options, SpaceMouseMotion motion)
      : options_(options), motion_(std::move(motion)) {}

  /// Its reports until `now`, in order; the first time from 0 on.
  std::vector<SpaceMouseReport> advance(std::chrono::nanoseconds now);

  /// Bit 0 is the first button. Sent at the time of the next report, like the battery.
  void press(std::uint32_t buttons) { buttons_to_tell_ = buttons; }
  void set_battery(std::uint8_t percent) { battery_to_tell_ = percent; }

  /// Data written by the host; false if it is not for the light.
  bool take_output(std::span<const std::uint8_t> report);
  bool lit() const noexcept { return lit_; }

  /// The next `count` axis reports are lost on the radio link.
  void lose(int count) noexcept { lost_ = count; }

  /// Application collection: generic desktop (1), multi-axis controller (8).
  std::vector<std::uint8_t> report_descriptor() const;
  std::chrono::milliseconds period() const noexcept;

 private:
  void send(std::vector<SpaceMouseReport>& sent, std::vector<std::uint8_t> bytes) const;
  void send_axes(std::vector<SpaceMouseReport>& sent);

  EmulatedSpaceMouseOptions options_;
  SpaceMouseMotion motion_;
  std::chrono::nanoseconds next_{};
  std::array<std::int16_t, 6> axes_{};  // of this round
  bool rotation_is_next_ = false;
  int zeros_to_send_ = 0;
  std::optional<std::uint32_t> buttons_to_tell_;
  std::optional<std::uint8_t> battery_to_tell_;
  int lost_ = 0;
  bool lit_ = false;
};

}  // namespace sim::devices
