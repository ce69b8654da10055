/// @file
/// What a 3Dconnexion SpaceMouse reports over HID.
///
/// A report's first byte is its number: 1 holds the three translations, or all six axes in newer devices,
/// which its length tells; 2 the three rotations of older ones; 3 the buttons; 23 the battery. Axes are
/// signed 16-bit little-endian deflections, about ±350 at the stop. Source: device descriptions of
/// AndunHH/spacemouse and JakubAndrysek/PySpaceMouse.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>

namespace drivers::haptic {

/// Frame: x to the right, y away from the user, z up, as one looks at the device; rotations right-handed
/// about the same axes. One at the stop of each axis, by its nominal range.
struct SpaceMouseDeflection {
  std::array<double, 3> translation{};
  std::array<double, 3> rotation{};
  bool operator==(const SpaceMouseDeflection&) const = default;
};

/// Puts reports together. One thread; never allocates, locks or throws.
class SpaceMouseReports {
 public:
  /// `now`: any steady clock. False for a report that is none of a SpaceMouse's, or cut short: it changes
  /// nothing.
  bool take(std::span<const std::uint8_t> report, std::chrono::nanoseconds now) noexcept;

  /// The cap counts as released until it is reported again.
  void release() noexcept;

  /// A device at rest is silent, after it has reported zeros. One that reported a deflection and then nothing
  /// for kSilence lost its last reports: it counts as released, as it does when the clock ran backwards.
  /// Translation and rotation each by itself, so that what was lost of one does not come back with the other.
  SpaceMouseDeflection deflection(std::chrono::nanoseconds now) const noexcept;
  std::uint32_t buttons() const noexcept { return buttons_; }  ///< bit 0 is the first, on the left
  std::optional<int> battery_percent() const noexcept { return battery_percent_; }
  std::uint64_t unknown_reports() const noexcept { return unknown_; }

  /// Deflected devices report every 8 to 16 ms.
  static constexpr std::chrono::milliseconds kSilence{150};

 private:
  SpaceMouseDeflection deflection_{};
  std::chrono::nanoseconds translated_at_{};
  std::chrono::nanoseconds rotated_at_{};
  std::uint32_t buttons_ = 0;
  std::optional<int> battery_percent_;
  std::uint64_t unknown_ = 0;
};

/// The report that switches the light on or off.
constexpr std::array<std::uint8_t, 2> space_mouse_light(bool on) noexcept {
  return {std::uint8_t{4}, on ? std::uint8_t{1} : std::uint8_t{0}};
}

}  // namespace drivers::haptic
