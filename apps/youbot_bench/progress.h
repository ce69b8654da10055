/// @file
/// How far a long piece of work is, told without disturbing it.
#pragma once
#include <atomic>
#include <chrono>
#include <string>

namespace youbot_bench {

/// A bar on a terminal, a line now and then elsewhere, on standard error; nothing when quiet. The worker
/// calls set(), which is wait-free, from its cycle; another thread calls show(), as often as it likes.
class Progress {
 public:
  Progress(std::string name, int measurements, bool quiet);

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
  using Clock = std::chrono::steady_clock;
  std::string text() const;

  std::string name_;
  int measurements_;
  bool quiet_;
  bool terminal_;
  bool shown_ = false;
  Clock::time_point begin_;
  Clock::time_point told_;
  std::atomic<int> measurement_{0};
  std::atomic<double> done_s_{0};
  std::atomic<double> left_s_{0};
};

/// "7 h 48 min", "1 min 05 s", "12 s".
std::string duration_text(double seconds);

}  // namespace youbot_bench
