/// @file
/// How far a long piece of work is, for the person who waits for it.
#pragma once
#include <chrono>
#include <string>
#include <string_view>

namespace runtime {

/// A bar on a terminal; elsewhere a line for each new stage, at most one a second, and one now and then while
/// a stage lasts. All on standard error; nothing when quiet. One thread.
class ProgressLine {
 public:
  ProgressLine(std::string name, bool quiet);
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  /// Clears away a bar that was not finished: what comes next begins on a line of its own.
  ~ProgressLine();

  /// As often as one likes. `done`: share of the whole, 0 to 1, NaN when nobody knows. `detail` stands behind
  /// it.
  void show(std::string_view stage, double done, std::string_view detail = {});
  /// Leaves the last state standing on a line of its own.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  std::string text(Clock::time_point now) const;

  std::string name_;
  bool quiet_;
  bool terminal_;
  bool shown_ = false;
  std::string stage_{};
  std::string told_stage_{};
  std::string detail_{};
  double done_ = 0;
  Clock::time_point begin_;
  Clock::time_point told_;
};

/// "7 h 48 min", "1 min 05 s", "12 s".
std::string duration_text(double seconds);

}  // namespace runtime
