/// @file
/// Progress display for long work.
#pragma once
#include <chrono>
#include <string>
#include <string_view>

namespace runtime {

/// A bar on a terminal; elsewhere a line for each new stage, at most one per second, and occasionally another
/// one during a long stage. All on standard error; nothing if quiet. One thread.
class ProgressLine {
 public:
  ProgressLine(std::string name, bool quiet);
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  /// Clears an unfinished bar, so that the next output starts on its own line.
  ~ProgressLine();

  /// May be called at any rate. `done`: share of the whole, 0 to 1, NaN if unknown. `detail` follows it.
  void show(std::string_view stage, double done, std::string_view detail = {});
  /// Leaves the last state on its own line.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  std::string text(Clock::time_point now) const;

  std::string name_;
  bool quiet_;
  bool terminal_;
  bool shown_ = false;
  std::string stage_{};
  std::string printed_stage_{};
  std::string detail_{};
  double done_ = 0;
  Clock::time_point begin_;
  Clock::time_point printed_;
};

/// "7 h 48 min", "1 min 05 s", "12 s".
std::string duration_text(double seconds);

}  // namespace runtime
