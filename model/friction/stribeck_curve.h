/// @file
/// Sliding friction against speed, without its viscous part.
#pragma once
#include <algorithm>
#include <cmath>

namespace model::friction {

/// exp(−r^δ) of the ratio r = |v|/vs: 1 at rest, towards 0 at speed. The usual exponents 1 and 2 cost less.
inline double stribeck_share(double ratio, double exponent) noexcept {
  if (ratio == 0) return 1;
  const double power = exponent == 2   ? ratio * ratio
                       : exponent == 1 ? ratio
                                       : std::exp(exponent * std::log(ratio));  // faster than pow
  return std::exp(-power);
}

/// s(v) = Fc + (Fs − Fc)·exp(−|v/vs|^δ)      [N·m; thesis 2.3, the KFM without σ2·v]
/// Between Fc and Fs, even in v. Fs below Fc is allowed: a curve that rises. Fs = Fc costs less.
class StribeckCurve {
 public:
  /// `P` is a law's Parameters with the four names; the law has checked them.
  template <class P>
  explicit StribeckCurve(const P& parameters) noexcept
      : coulomb_Nm_(parameters.coulomb_Nm),
        excess_Nm_(parameters.static_Nm - parameters.coulomb_Nm),
        inverse_velocity_(1 / parameters.stribeck_velocity_rad_per_s),
        exponent_(parameters.stribeck_exponent) {}

  double level_Nm(double velocity_rad_per_s) const noexcept {
    if (excess_Nm_ == 0) return coulomb_Nm_;
    return coulomb_Nm_ +
           excess_Nm_ * stribeck_share(std::abs(velocity_rad_per_s) * inverse_velocity_, exponent_);
  }
  double breakaway_Nm() const noexcept { return coulomb_Nm_ + excess_Nm_; }
  double least_Nm() const noexcept { return std::min(coulomb_Nm_, coulomb_Nm_ + excess_Nm_); }
  double most_Nm() const noexcept { return std::max(coulomb_Nm_, coulomb_Nm_ + excess_Nm_); }

 private:
  double coulomb_Nm_;
  double excess_Nm_;
  double inverse_velocity_;
  double exponent_;
};

}  // namespace model::friction
