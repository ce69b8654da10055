/// @file
/// Detects what no motion can cause in a position: an abrupt step of its rate, as of a scale that changes or
/// a count that stops, and a jump, as of counts that are lost at once.
#pragma once
#include <array>
#include <cstddef>

#include "control/plausibility/sample_time.h"

namespace control {

/// Examines a dozen samples: steady before, steady after, and a step or a jump in between that no inertia
/// allows. A blow, a slipping wheel or a late sample spreads over several samples and leaves one side
/// unsteady, and so does a single wrong position, which returns. A step or jump does not count if it vanishes
/// at some sample times within the bounds. The check tolerates a missing
/// sample, but not two in a row: the longer interval is treated like the others, and the change that a steady
/// acceleration makes in it is not a step. One thread. Cycle: update() and restart() neither allocate nor
/// throw.
class VelocityStep {
 public:
  /// @param step_rad_per_s minimum step that counts, besides a quarter of the speed.
  /// @param jump_rad minimum jump that counts, besides the motion within the bounds of the samples' times.
  VelocityStep(double step_rad_per_s, double jump_rad) noexcept
      : step_rad_per_s_(step_rad_per_s), jump_rad_(jump_rad) {}

  void restart() noexcept { count_ = 0; }
  /// Whether it has as many regular samples as it compares.
  bool full() const noexcept { return count_ > kMemory; }
  /// Call with each fresh sample. True: such a step or jump occurred.
  bool update(double position_rad, const SampleTime& time) noexcept;

 private:
  static constexpr std::size_t kSide = 6;
  static constexpr std::size_t kMemory = 2 * kSide + 1;

  /// Minimum difference of the mean rates of both sides over all sample times within the bounds.
  double least_difference_rad_per_s() const noexcept;
  bool stepped() const noexcept;
  bool jumped() const noexcept;
  /// Mean interval, without the longest one.
  double usual_s() const noexcept;
  /// Time by which a missing sample lengthens the interval between the sides, or one next to it.
  double missing_s() const noexcept;

  double step_rad_per_s_;
  double jump_rad_;
  double position_rad_ = 0.0;
  std::size_t count_ = 0;
  // The oldest first.
  std::array<double, kMemory> rates_rad_per_s_{};
  std::array<double, kMemory> elapsed_s_{};
  std::array<double, kMemory + 1> bounds_s_{};  // one more sample than rates between them
};

}  // namespace control
