#include "sim/bus/distributed_clock.h"

#include <algorithm>
#include <cmath>

namespace sim::bus {
namespace {

// Well damped for system time written once per cycle: natural frequency 1/32 per write, damping 1.
constexpr double kProportional = 1.0 / 16;
constexpr double kIntegral = 1.0 / 1024;
constexpr double kFastestSlew = 1e-3;  // ns per ns; silicon changes by about one part in a thousand
constexpr double kLargestCorrection = 5e-4;

}  // namespace

void DistributedClock::power_up(std::chrono::nanoseconds now) noexcept {
  base_ = now;
  local_ = crystal_.start_ns;
  fraction_ = 0.0;
  reset_filters(now);
}

std::int64_t DistributedClock::local_ns(std::chrono::nanoseconds now) const noexcept {
  const std::int64_t elapsed = (now - base_).count();
  const double extra = static_cast<double>(elapsed) * (1e-6 * crystal_.drift_ppm + correction_) + fraction_;
  return local_ + elapsed + static_cast<std::int64_t>(std::floor(extra));
}

void DistributedClock::rebase(std::chrono::nanoseconds now) noexcept {
  const std::int64_t elapsed = (now - base_).count();
  const double extra = static_cast<double>(elapsed) * (1e-6 * crystal_.drift_ppm + correction_) + fraction_;
  local_ += elapsed + static_cast<std::int64_t>(std::floor(extra));
  fraction_ = extra - std::floor(extra);
  base_ = now;
}

void DistributedClock::steer(std::chrono::nanoseconds now, std::int32_t error_ns,
                             unsigned filter_depth) noexcept {
  const double error = error_ns;
  const bool first = !steered_;
  const double elapsed = static_cast<double>((now - last_).count());
  mean_ = first ? error : mean_ + (error - mean_) / static_cast<double>(1U << std::min(filter_depth, 15U));
  steered_ = true;
  last_ = now;
  if (first || elapsed <= 0.0) return;

  rebase(now);
  const double largest = kFastestSlew * elapsed;
  const double step = std::clamp(kProportional * error, -largest, largest);
  fraction_ -= step;
  local_ += static_cast<std::int64_t>(std::floor(fraction_));
  fraction_ -= std::floor(fraction_);
  if (std::abs(step) < largest) {  // no wind-up while the phase is still being corrected
    correction_ =
        std::clamp(correction_ - kIntegral * error / elapsed, -kLargestCorrection, kLargestCorrection);
  }
}

void DistributedClock::reset_filters(std::chrono::nanoseconds now) noexcept {
  rebase(now);
  correction_ = 0.0;
  steered_ = false;
  mean_ = 0.0;
}

std::uint32_t DistributedClock::difference() const noexcept {
  const auto magnitude = static_cast<std::uint32_t>(std::min(std::round(std::abs(mean_)), 2147483647.0));
  return magnitude | (mean_ < 0.0 ? 0x8000'0000U : 0U);
}

std::int16_t DistributedClock::speed_difference(std::uint16_t start) const noexcept {
  if (std::abs(correction_) < 1e-9) return 0;
  const double reach = start + 2.0;
  const double root = std::sqrt(1.0 + 100.0 * correction_ * correction_ * reach * reach);
  return static_cast<std::int16_t>(std::lround((root - 1.0) / (10.0 * correction_)));
}

}  // namespace sim::bus
