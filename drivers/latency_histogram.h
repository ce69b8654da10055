/// @file
/// Quantiles of durations without storing them.
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstdint>

namespace drivers {

/// Counts durations from 0 to about 4 s in buckets with a width of a sixteenth of their value (1 ns below 16
/// ns), so a quantile is at most 6.25 % too high. Cycle: add(). One thread.
class LatencyHistogram {
 public:
  void add(std::chrono::nanoseconds duration) noexcept {
    const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(duration.count(), 0));
    ++counts_[bucket_of(value)];
    ++total_;
    best_ = total_ == 1 ? duration : std::min(best_, duration);
    worst_ = std::max(worst_, duration);
  }

  /// Duration that `fraction` (0 to 1) of all do not exceed, rounded up to its bucket; for 1 the maximum.
  /// Zero if nothing was added.
  std::chrono::nanoseconds quantile(double fraction) const noexcept {
    const double wanted = fraction * static_cast<double>(total_);
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      seen += counts_[i];
      if (seen > 0 && static_cast<double>(seen) >= wanted)
        return std::min(worst_, std::chrono::nanoseconds(static_cast<std::int64_t>(upper_bound_of(i))));
    }
    return worst_;
  }
  std::chrono::nanoseconds best() const noexcept { return best_; }  ///< 0 if nothing was added
  std::chrono::nanoseconds worst() const noexcept { return worst_; }
  std::uint64_t count() const noexcept { return total_; }

 private:
  static constexpr unsigned kSubBits = 4;  // 16 buckets per power of two
  static constexpr std::uint64_t kLargest = (std::uint64_t{1} << 32) - 1;

  static std::size_t bucket_of(std::uint64_t value) noexcept {
    value = std::min(value, kLargest);
    if (value < (1U << kSubBits)) return static_cast<std::size_t>(value);
    const auto shift = static_cast<unsigned>(std::bit_width(value)) - kSubBits - 1;
    return (std::size_t{shift} << kSubBits) + static_cast<std::size_t>(value >> shift);
  }
  static std::uint64_t upper_bound_of(std::size_t bucket) noexcept {
    if (bucket < (2U << kSubBits)) return bucket;
    const std::size_t shift = (bucket >> kSubBits) - 1;
    const std::uint64_t mantissa = (bucket & ((1U << kSubBits) - 1)) + (1U << kSubBits);
    return ((mantissa + 1) << shift) - 1;
  }

  std::array<std::uint64_t, (32 - kSubBits + 1) << kSubBits> counts_{};
  std::uint64_t total_ = 0;
  std::chrono::nanoseconds best_{};
  std::chrono::nanoseconds worst_{};
};

}  // namespace drivers
