/// @file
/// The clock of a slave and its synchronisation to the reference clock (ESC data sheet section I, chapter 9).
#pragma once
#include <chrono>
#include <cstdint>

namespace sim::bus {

/// Counts nanoseconds from power-up at its own rate. System time written by the master controls rate and
/// phase: our own proportional-integral controller instead of the silicon's counters, with the same registers
/// and sign: Δt = (local + offset - delay) - received; positive slows the clock down.
class DistributedClock {
 public:
  struct Crystal {
    std::int64_t start_ns = 0;  ///< value at power-up
    double drift_ppm = 0.0;     ///< fast if positive
  };

  explicit DistributedClock(Crystal crystal) noexcept : crystal_(crystal) { power_up({}); }

  /// `now`: emulated time, the same for all slaves.
  void power_up(std::chrono::nanoseconds now) noexcept;
  /// Local time at emulated time `now`.
  std::int64_t local_ns(std::chrono::nanoseconds now) const noexcept;

  /// System time (0x0910) was written: `error_ns` is Δt, `filter_depth` register 0x0934.
  void steer(std::chrono::nanoseconds now, std::int32_t error_ns, unsigned filter_depth) noexcept;
  /// Speed counter start (0x0930) was written: forgets the mean and the rate correction.
  void reset_filters(std::chrono::nanoseconds now) noexcept;
  /// Register 0x092C: magnitude of the mean Δt, bit 31 set if the local time lags.
  std::uint32_t difference() const noexcept;
  /// Register 0x0932, derived from 0x0930: d, so that the correction is d / (5 (start + d + 2) (start - d +
  /// 2)) (section II, table 105).
  std::int16_t speed_difference(std::uint16_t start) const noexcept;
  /// Rate correction of the crystal, in parts per million.
  double correction_ppm() const noexcept { return 1e6 * correction_; }

 private:
  void rebase(std::chrono::nanoseconds now) noexcept;

  Crystal crystal_;
  std::chrono::nanoseconds base_{};  // emulated time at which the local time was local_
  std::int64_t local_ = 0;
  double fraction_ = 0.0;    // of a nanosecond, on top of local_
  double correction_ = 0.0;  // relative
  double mean_ = 0.0;        // ns
  bool steered_ = false;     // mean_ and last_ are valid
  std::chrono::nanoseconds last_{};
};

}  // namespace sim::bus
