/// @file
/// A current sensor that reports magnitude only.
#pragma once
#include <array>
#include <cmath>

#include "model/effects/effect.h"

namespace model::effects {

struct UnsignedCurrentParameters {};

class UnsignedCurrent : public WithParameters<UnsignedCurrent, UnsignedCurrentParameters> {
 public:
  static constexpr std::string_view kName = "unsigned_current";
  static constexpr std::string_view kShows =
      "measured torque is never negative, whichever way the joint is driven";
  static constexpr std::array<ParameterInfo<UnsignedCurrentParameters>, 0> kParameters{};
  using WithParameters::WithParameters;

  double report_Nm(double torque_Nm) const noexcept { return std::abs(torque_Nm); }
};

}  // namespace model::effects
