/// @file
/// Data for the report on two models and one set of data.
#pragma once
#include <vector>

#include "identification/gap/fitted_model.h"
#include "identification/gap/gap.h"

namespace identification::gap {

/// Mean residual against each coordinate, and its rms over frequency, with both models.
std::vector<ResidualMap> residual_maps(const FittedModel& before, const FittedModel& after, const Rows& rows,
                                       const std::vector<Eigen::Index>& use);
FrictionCurve friction_curve(const FittedModel& before, const FittedModel& after, const Rows& rows);

/// Free simulation in windows of a second from the measured state, driven by the delivered torque.
struct Simulated {
  double before_rad_per_s = 0;  ///< rms velocity error
  double after_rad_per_s = 0;
  std::vector<Trace> traces;  ///< the windows in which the models differ most
};
Simulated simulate(const model::effects::DriveModel& before, const model::effects::DriveModel& after,
                   const std::vector<Signals>& signals, const Rows& rows,
                   const std::vector<Eigen::Index>& use);

/// Where `contribution` (rows) is at least half of its maximum, along the coordinate that suits the effect.
Where where_of(std::string_view effect, const Eigen::VectorXd& contribution, const Rows& rows,
               const std::vector<Eigen::Index>& use);

}  // namespace identification::gap
