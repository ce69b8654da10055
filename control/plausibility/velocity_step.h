/// @file
/// Notices a position whose rate of change steps at once, as no motion does: a scale that changes, a count
/// that stops.
#pragma once
#include <array>
#include <cstddef>

#include "control/plausibility/sample_time.h"

namespace control {

/// Looks at a dozen samples: steady before, steady after, and a step between that no inertia allows. A blow,
/// a wheel that slips or a late sample spreads over several samples and leaves one side unsteady. A step that
/// is none at some times within the samples' bounds does not count. A missing sample does not blind it, but
/// no two may be missing in a row: a longer interval is one like the others, and what a steady acceleration
/// does in it is no step. One thread. Cycle: update() and restart() neither allocate nor throw.
class VelocityStep {
 public:
  /// @param step_rad_per_s the smallest that counts, besides a quarter of the speed.
  explicit VelocityStep(double step_rad_per_s) noexcept : step_rad_per_s_(step_rad_per_s) {}

  void restart() noexcept { count_ = 0; }
  /// Whether it has as many regular samples as it compares.
  bool full() const noexcept { return count_ > kMemory; }
  /// With each fresh sample. True: such a step was there.
  bool update(double position_rad, const SampleTime& time) noexcept;

 private:
  static constexpr std::size_t kSide = 6;
  static constexpr std::size_t kMemory = 2 * kSide + 1;

  /// Of the mean rates of both sides, for any times within the bounds.
  double least_difference_rad_per_s() const noexcept;
  /// Mean interval without the longest.
  double usual_s() const noexcept;
  /// How much longer a missing sample makes the interval between the sides, or one beside it.
  double missing_s() const noexcept;

  double step_rad_per_s_;
  double position_rad_ = 0.0;
  std::size_t count_ = 0;
  // The oldest first.
  std::array<double, kMemory> rates_rad_per_s_{};
  std::array<double, kMemory> elapsed_s_{};
  std::array<double, kMemory + 1> bounds_s_{};  // of the samples: one more than rates between them
};

}  // namespace control
