#include "control/limits.h"

#include <algorithm>
#include <cmath>

namespace control {

Limited<PlanarVector> limited_wrench(const PlanarVector& wrench, const WrenchLimits& limits) noexcept {
  Limited<PlanarVector> result{wrench};
  const double force_N = wrench.head<2>().stableNorm();  // no overflow on the way
  if (force_N > limits.force_N) {
    result.value.head<2>() *= limits.force_N / force_N;
    result.limited = true;
  }
  if (std::abs(wrench[2]) > limits.moment_Nm) {
    result.value[2] = std::copysign(limits.moment_Nm, wrench[2]);
    result.limited = true;
  }
  return result;
}

Limited<WheelVector> limited_torque(const WheelVector& torque_Nm, double limit_Nm) noexcept {
  const double largest_Nm = torque_Nm.cwiseAbs().maxCoeff();
  if (largest_Nm <= limit_Nm) return {torque_Nm};
  return {torque_Nm * (limit_Nm / largest_Nm), true};
}

}  // namespace control
