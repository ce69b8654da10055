/// @file
/// Time as a parameter: the same loop runs on the machine's clock or in lock-step on virtual time.
#pragma once
#include <chrono>

namespace hal {

/// Only one thread sleeps on a clock; any thread may call now() of a SteadyClock.
class Clock {
 public:
  Clock() = default;
  Clock(const Clock&) = delete;
  Clock& operator=(const Clock&) = delete;
  virtual ~Clock() = default;

  /// Cycle. Monotonic; the origin is arbitrary.
  virtual std::chrono::nanoseconds now() const noexcept = 0;
  /// True for the machine's clock, which real robots and people share. Default: false.
  virtual bool is_real() const noexcept { return false; }
  /// Cycle. Returns at `deadline` or later; immediately if it has passed.
  virtual void sleep_until(std::chrono::nanoseconds deadline) noexcept = 0;
};

/// CLOCK_MONOTONIC with absolute deadlines, so that a late wake-up does not shift the next one.
class SteadyClock final : public Clock {
 public:
  bool is_real() const noexcept override { return true; }
  std::chrono::nanoseconds now() const noexcept override;
  void sleep_until(std::chrono::nanoseconds deadline) noexcept override;
};

/// Starts at zero and jumps to every deadline. Single-threaded.
class VirtualClock final : public Clock {
 public:
  std::chrono::nanoseconds now() const noexcept override { return now_; }
  void sleep_until(std::chrono::nanoseconds deadline) noexcept override {
    if (deadline > now_) now_ = deadline;
  }

 private:
  std::chrono::nanoseconds now_{};
};

}  // namespace hal
