#include "control/friction_compensator.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace control {

FrictionCompensator::FrictionCompensator(const Config& config) : config_(config) {
  if (!(config.margin >= 0 && config.margin <= 1))
    throw std::invalid_argument("friction compensator: margin = " + std::to_string(config.margin) +
                                ", expected 0 to 1");
  if (!(config.full_command_Nm > 0))
    throw std::invalid_argument("friction compensator: full_command_Nm must be positive");
}

double FrictionCompensator::torque_Nm(double command_Nm, const FrictionEstimate& estimate,
                                      const FrictionObserver& observer, double factor) const noexcept {
  const double share = std::clamp(command_Nm / config_.full_command_Nm, -1.0, 1.0);
  const double holding_Nm =
      estimate.rest * observer.holding_Nm(std::abs(estimate.velocity_rad_per_s), command_Nm);
  const double help_Nm =
      config_.margin * (std::abs(share) * (factor * estimate.friction_Nm + estimate.position_Nm) +
                        share * factor * holding_Nm);
  // Written so that NaN stays NaN.
  return help_Nm * command_Nm < 0 && std::abs(help_Nm) > std::abs(command_Nm) ? -command_Nm : help_Nm;
}

}  // namespace control
