/// @file
/// How far the measurements are, told without disturbing them.
#pragma once
#include <atomic>
#include <string>
#include <utility>

#include "runtime/program/progress_line.h"

namespace youbot_bench {

using runtime::duration_text;

/// The worker calls set(), which is wait-free, from its cycle; another thread calls show(), as often as it
/// likes.
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
  /// Leaves the last state standing on a line of its own.
  void finish();

 private:
  runtime::ProgressLine line_;
  int measurements_;
  std::atomic<int> measurement_{0};
  std::atomic<double> done_s_{0};
  std::atomic<double> left_s_{0};
};

}  // namespace youbot_bench
