/// @file
/// Counts cycles within a window that the bus did not answer completely, although each gap was short enough
/// to be bridged.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "hal/robot.h"

namespace hal {

/// Outcome of one cycle.
struct CycleLoss {
  bool lost = false;        ///< no answer in time
  bool damaged = false;     ///< a malformed frame, or one that was not sent, was received
  bool incomplete = false;  ///< answered, but not by all devices
  int late = 0;             ///< answers to earlier cycles, received after their time-out
  int twice = 0;            ///< further answers to a cycle that already had one
};

/// The last kCycles cycles. Cycle-safe: fixed size.
class LossWindow {
 public:
  static constexpr std::size_t kCycles = 1000;

  void add(const CycleLoss& cycle) noexcept {
    count(cycles_[next_], -1);
    cycles_[next_] = cycle;
    count(cycle, 1);
    next_ = (next_ + 1) % kCycles;
  }
  void clear() noexcept { *this = {}; }
  const BusLosses& counts() const noexcept { return counts_; }

 private:
  void count(const CycleLoss& cycle, int step) noexcept {
    const auto add_if = [step](bool condition, int& sum) { sum += condition ? step : 0; };
    add_if(cycle.lost || cycle.incomplete, counts_.cycles);
    add_if(cycle.lost, counts_.lost);
    add_if(cycle.damaged, counts_.damaged);
    add_if(cycle.incomplete, counts_.incomplete);
    counts_.late += step * cycle.late;
    counts_.twice += step * cycle.twice;
  }

  std::array<CycleLoss, kCycles> cycles_{};
  std::size_t next_ = 0;
  BusLosses counts_;
};

}  // namespace hal
