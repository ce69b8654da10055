/// @file
/// Progress of the measurements, displayed without disturbing them.
#pragma once
#include <atomic>
#include <string>
#include <utility>

#include "runtime/program/progress_line.h"

namespace youbot_bench {

using runtime::duration_text;

/// The worker calls set(), which is wait-free, from its cycle; another thread calls show(), at any rate.
class Progress {
 public:
  Progress(std::string name, int measurements, bool quiet)
      : line_(std::move(name), quiet), measurements_(measurements) {}

  /// Cycle. `done` and `left` in seconds of the robot's time.
  void set(int measurement, double done_s, double left_s) noexcept {
    measurement_.store(measurement, std::memory_order_relaxed);
    done_s_.store(done_s, std::memory_order_relaxed);
    left_s_.store(left_s, std::memory_order_relaxed);
  }
  void show();
  /// Leaves the last state on its own line.
  void finish();

 private:
  runtime::ProgressLine line_;
  int measurements_;
  std::atomic<int> measurement_{0};
  std::atomic<double> done_s_{0};
  std::atomic<double> left_s_{0};
};

}  // namespace youbot_bench
