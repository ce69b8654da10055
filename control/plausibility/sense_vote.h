/// @file
/// Compares the four wheels' senses of rotation, each of a motor's Hall sensors relative to its encoder.
#pragma once
#include <array>
#include <optional>

namespace control {

/// All wheels have the same boards and motors, so their Hall sensors count in the same sense relative to
/// their encoders, whatever that sense is: an encoder that counts backwards from power-up differs from the
/// other wheels' encoders. With all four senses known the vote is immediate; without, it waits for those
/// of wheels that turn more slowly. One thread. Cycle: update() and restart() neither allocate nor throw.
class SenseVote {
 public:
  void restart() noexcept { differ_s_ = 0.0; }
  /// Call with each fresh sample, `elapsed_s` after the last one. `senses`: HallAgreement::sense() of each
  /// wheel. Returns the wheel that differs from the others, or -1 if as many differ as agree.
  std::optional<int> update(const std::array<int, 4>& senses, double elapsed_s) noexcept;

 private:
  double differ_s_ = 0.0;  // for which known senses have differed
};

}  // namespace control
