/// @file
/// How strong sliding friction is against speed, without its viscous part.
#pragma once
#include <algorithm>
#include <cmath>

namespace model::friction {

/// s(v) = Fc + (Fs − Fc)·exp(−|v/vs|^δ)      [N·m; thesis 2.3, the KFM without σ2·v]
/// Between Fc and Fs, even in v. Fs below Fc is allowed: a curve that rises. The usual exponents 1 and 2, and
/// Fs = Fc, cost less.
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
    const double ratio = std::abs(velocity_rad_per_s) * inverse_velocity_;
    if (ratio == 0) return coulomb_Nm_ + excess_Nm_;
    const double power = exponent_ == 2   ? ratio * ratio
                         : exponent_ == 1 ? ratio
                                          : std::exp(exponent_ * std::log(ratio));  // faster than pow
    return coulomb_Nm_ + excess_Nm_ * std::exp(-power);
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
