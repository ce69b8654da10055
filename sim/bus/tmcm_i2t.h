/// @file
/// The motor controller's thermal protection of the winding (TMCM-1630 manual, chapter 9).
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace sim::bus {

/// Sum of I²·Δt [A²·ms] over the last thermal winding time; above the limit it sets the flag:
///   constant I from cold:  exceeded after limit / I², if that is less than the winding time.
/// The flag stays until clear(), which works only after the winding has cooled for the winding time. The
/// window moves in kBuckets steps.
class I2tMonitor {
 public:
  void update(double current_A, std::int32_t winding_time_ms, double limit_A2_ms,
              std::chrono::nanoseconds step) noexcept;
  bool exceeded() const noexcept { return exceeded_; }
  double sum_A2_ms() const noexcept { return sum_; }
  /// Started seconds above the limit, since the last power-up (parameter 28 counts them).
  std::int32_t seconds_exceeded() const noexcept { return seconds_; }
  /// False: the winding is still cooling.
  bool clear(std::int32_t winding_time_ms) noexcept;
  void reset() noexcept { *this = {}; }

 private:
  static constexpr std::size_t kBuckets = 128;
  std::array<double, kBuckets> buckets_{};
  std::size_t newest_ = 0;
  std::chrono::nanoseconds in_bucket_{};
  double full_A2_ms_ = 0.0;  // of all buckets except the newest
  double sum_ = 0.0;
  bool exceeded_ = false;
  std::chrono::nanoseconds since_exceeded_{};
  std::int32_t seconds_ = 0;
};

}  // namespace sim::bus
