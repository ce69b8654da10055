/// @file
/// How well the base followed its reference, accumulated during the run.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "operation/cycle_record.h"

namespace operation {

/// Measured on the true pose if the base is simulated, otherwise on odometry.
class PathMetrics {
 public:
  /// Further than this from the start, the base has moved: a hundred times the compliance of the stuck
  /// wheels.
  static constexpr double kMotion_m = 1e-3;
  static constexpr double kMotion_rad = 2e-3;

  /// Cycle.
  void add(const CycleRecord& record) noexcept {
    on_truth_ = std::isfinite(record.truth_W[0]);
    const std::array<double, 3>& pose = on_truth_ ? record.truth_W : record.odometry_W;
    if (record.phase == Phase::kRunning && std::isfinite(record.reference_W[0])) {
      if (!begin_) {
        begin_ = record.time;
        start_ = pose;
      }
      final_m_ = std::hypot(record.reference_W[0] - pose[0], record.reference_W[1] - pose[1]);
      final_rad_ = std::abs(record.reference_W[2] - pose[2]);
      worst_m_ = std::max(worst_m_, final_m_);
      worst_rad_ = std::max(worst_rad_, final_rad_);
      sum_m2_ += final_m_ * final_m_;
      ++count_;
      if ((record.limited & limiter::kEffort) != 0) ++limited_;
    }
    if (begin_ && !first_motion_ &&
        (std::hypot(pose[0] - start_[0], pose[1] - start_[1]) > kMotion_m ||
         std::abs(pose[2] - start_[2]) > kMotion_rad))
      first_motion_ = record.time - *begin_;
  }

  bool on_truth() const noexcept { return on_truth_; }
  double rms_m() const noexcept {
    return count_ > 0 ? std::sqrt(sum_m2_ / static_cast<double>(count_)) : 0.0;
  }
  double worst_m() const noexcept { return worst_m_; }
  double worst_rad() const noexcept { return worst_rad_; }
  double final_m() const noexcept { return final_m_; }
  double final_rad() const noexcept { return final_rad_; }
  /// Share of the time in which the controller exceeded its limits.
  double limited_share() const noexcept {
    return count_ > 0 ? static_cast<double>(limited_) / static_cast<double>(count_) : 0.0;
  }
  /// Since the drives began to obey; empty if the base never moved.
  std::optional<std::chrono::nanoseconds> first_motion() const noexcept { return first_motion_; }

 private:
  bool on_truth_ = false;
  double sum_m2_ = 0.0;
  double worst_m_ = 0.0;
  double worst_rad_ = 0.0;
  double final_m_ = 0.0;
  double final_rad_ = 0.0;
  std::uint64_t count_ = 0;
  std::uint64_t limited_ = 0;
  std::optional<std::chrono::nanoseconds> begin_;
  std::array<double, 3> start_{};
  std::optional<std::chrono::nanoseconds> first_motion_;
};

}  // namespace operation
