/// @file
/// Notices a position whose rate of change steps at once, as no motion does: a scale that changes, a count
/// that stops.
#pragma once
#include <array>
#include <cstddef>

namespace control {

/// Looks at a dozen cycles: steady before, steady after, and a step between that no inertia allows. A blow, a
/// wheel that slips or a late sample spreads over several cycles and leaves one side unsteady.
/// One thread. Cycle: update() and restart() neither allocate nor throw.
class VelocityStep {
 public:
  /// @param step_rad_per_s the smallest that counts, besides a quarter of the speed.
  explicit VelocityStep(double step_rad_per_s) noexcept : step_rad_per_s_(step_rad_per_s) {}

  void restart() noexcept { count_ = 0; }
  /// With each fresh sample, `elapsed_s` after the last one. True: such a step was there.
  bool update(double position_rad, double elapsed_s) noexcept;

 private:
  static constexpr std::size_t kSide = 6;
  static constexpr std::size_t kMemory = 2 * kSide + 1;

  double step_rad_per_s_;
  double position_rad_ = 0.0;
  std::size_t count_ = 0;
  std::array<double, kMemory> rates_rad_per_s_{};  // the oldest first
};

}  // namespace control
