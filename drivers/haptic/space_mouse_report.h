/// @file
/// What a 3Dconnexion SpaceMouse reports over HID.
///
/// A report's first byte is its number: 1 holds the three translations, or all six axes in newer devices,
/// which its length tells; 2 the three rotations of older ones; 3 the buttons; 23 the battery. Axes are
/// signed 16-bit little-endian deflections, about ±350 at the stop. Source: device descriptions of
/// AndunHH/spacemouse and JakubAndrysek/PySpaceMouse.
#pragma once
#include <array>
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
  /// `now_s`: any steady clock. False for a report that is none of a SpaceMouse's, or cut short: it changes
  /// nothing.
  bool take(std::span<const std::uint8_t> report, double now_s) noexcept;

  /// The cap counts as released until it is reported again.
  void release() noexcept;

  /// A device at rest is silent, after it has reported zeros. One that reported a deflection and then nothing
  /// for kSilence_s lost its last reports: it counts as released. Translation and rotation each by itself, so
  /// that what was lost of one does not come back with the other.
  SpaceMouseDeflection deflection(double now_s) const noexcept;
  std::uint32_t buttons() const noexcept { return buttons_; }  ///< bit 0 is the first, on the left
  std::optional<int> battery_percent() const noexcept { return battery_percent_; }
  std::uint64_t unknown_reports() const noexcept { return unknown_; }

  /// Deflected devices report every 8 to 16 ms.
  static constexpr double kSilence_s = 0.15;

 private:
  SpaceMouseDeflection deflection_{};
  double translated_at_s_ = 0;
  double rotated_at_s_ = 0;
  std::uint32_t buttons_ = 0;
  std::optional<int> battery_percent_;
  std::uint64_t unknown_ = 0;
};

/// The report that switches the light on or off.
constexpr std::array<std::uint8_t, 2> space_mouse_light(bool on) noexcept {
  return {std::uint8_t{4}, on ? std::uint8_t{1} : std::uint8_t{0}};
}

}  // namespace drivers::haptic
