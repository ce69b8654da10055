/// @file
#pragma once
#include <cmath>

namespace identification::experiments {

/// After this time, in units of 1/cutoff, less than a thousandth of the initial state is left in a filter of
/// first or second order.
inline constexpr double kForgotten = 10.0;

/// First-order low-pass y' = ω·(u − y), exact for an input held between samples. Its mean equals the input's.
/// Cycle.
class LowPass {
 public:
  LowPass(double cutoff_rad_per_s, double period_s) noexcept
      : share_(1 - std::exp(-cutoff_rad_per_s * period_s)) {}
  void reset(double value) noexcept { value_ = value; }
  double step(double input) noexcept { return value_ += share_ * (input - value_); }
  double value() const noexcept { return value_; }

 private:
  double share_;
  double value_ = 0.0;
};

}  // namespace identification::experiments
