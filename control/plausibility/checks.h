/// @file
/// The checks of PlausibilityMonitor by name, and which of them are off.
#pragma once
#include <array>
#include <bitset>
#include <cstddef>
#include <string_view>

namespace control {

enum class PlausibilityCheck : std::size_t {
  kStillEncoder,
  kVelocityAgreement,
  kVelocityStep,
  kTorqueAgreement,
  kWheelAgreement,
  kOpposedMotion,
  kHallAgreement,
  kAwayFromTarget,
};
/// Names in configuration files and docs/safety.md, in the order above.
inline constexpr auto kPlausibilityCheckNames = std::to_array<std::string_view>(
    {"still_encoder", "velocity_agreement", "velocity_step", "torque_agreement", "wheel_agreement",
     "opposed_motion", "hall_agreement", "away_from_target"});

/// The disabled checks, for a robot on which a check raises false alarms or a bus on which it cannot judge.
/// None by default.
class ChecksOff {
 public:
  void add(PlausibilityCheck check) noexcept { off_.set(static_cast<std::size_t>(check)); }
  void add(const ChecksOff& others) noexcept { off_ |= others.off_; }
  bool has(PlausibilityCheck check) const noexcept { return off_.test(static_cast<std::size_t>(check)); }
  bool none() const noexcept { return off_.none(); }
  /// Whether all of them are off in `other`, too.
  bool within(const ChecksOff& other) const noexcept { return (off_ & ~other.off_).none(); }

 private:
  std::bitset<kPlausibilityCheckNames.size()> off_;
};

}  // namespace control
