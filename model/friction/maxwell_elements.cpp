#include "model/friction/maxwell_elements.h"

#include <stdexcept>
#include <string>

namespace model::friction {

MaxwellElements::MaxwellElements(std::string_view law, const Values& stiffness_Nm_per_rad,
                                 const Values& share) {
  double sum = 0.0;
  for (std::size_t i = 0; i < kMaxElements; ++i) {
    if (!(share[i] > 0)) continue;
    stiffness_Nm_per_rad_[count_] = stiffness_Nm_per_rad[i];
    compliance_rad_per_Nm_[count_] = 1 / stiffness_Nm_per_rad[i];
    row_[count_] = i;
    share_[count_++] = share[i];
    sum += share[i];
  }
  if (count_ == 0)
    throw std::invalid_argument("friction law " + std::string(law) +
                                ": share_1 to share_10 are all 0, expected at least one above");
  for (double& value : share_) value /= sum;
}

double MaxwellElements::total_stiffness_Nm_per_rad() const noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < count_; ++i) sum += stiffness_Nm_per_rad_[i];
  return sum;
}

double MaxwellElements::energy_J(const double* torque_Nm) const noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < count_; ++i) sum += torque_Nm[i] * torque_Nm[i] * compliance_rad_per_Nm_[i];
  return 0.5 * sum;
}

}  // namespace model::friction
