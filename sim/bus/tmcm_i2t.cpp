#include "sim/bus/tmcm_i2t.h"

#include <algorithm>
#include <numeric>

namespace sim::bus {

using std::chrono::nanoseconds;

void I2tMonitor::update(double current_A, std::int32_t winding_time_ms, double limit_A2_ms,
                        nanoseconds step) noexcept {
  const nanoseconds bucket_time =
      std::max(step, nanoseconds(std::chrono::milliseconds(winding_time_ms)) / static_cast<int>(kBuckets));
  in_bucket_ += step;
  if (in_bucket_ > bucket_time) {
    in_bucket_ = step;
    newest_ = (newest_ + 1) % kBuckets;
    buckets_[newest_] = 0.0;
    full_A2_ms_ = std::accumulate(buckets_.begin(), buckets_.end(), 0.0);
  }
  buckets_[newest_] += current_A * current_A * std::chrono::duration<double, std::milli>(step).count();
  sum_ = full_A2_ms_ + buckets_[newest_];

  if (exceeded_) {
    const auto before = std::chrono::floor<std::chrono::seconds>(since_exceeded_);
    since_exceeded_ += step;
    if (std::chrono::floor<std::chrono::seconds>(since_exceeded_) != before) ++seconds_;
  } else if (sum_ > limit_A2_ms) {
    exceeded_ = true;
    since_exceeded_ = {};
    ++seconds_;
  }
}

bool I2tMonitor::clear(std::int32_t winding_time_ms) noexcept {
  if (exceeded_ && since_exceeded_ < std::chrono::milliseconds(winding_time_ms)) return false;
  exceeded_ = false;
  return true;
}

}  // namespace sim::bus
