/// @file
/// Every effect that a model might lack, in all candidate shapes.
#pragma once
#include <Eigen/Core>
#include <functional>
#include <string_view>
#include <vector>

#include "identification/gap/fitted_model.h"
#include "identification/gap/regression.h"

namespace identification::gap {

/// An effect with a fixed shape: torque columns whose amplitudes are fitted.
struct Candidate {
  std::string_view effect;
  std::vector<Eigen::Index> columns;  ///< of the dictionary
  std::vector<Bounds> bounds;
  /// The model with this effect at those amplitudes, to be refined.
  std::function<FittedModel(const FittedModel&, const Eigen::VectorXd& amplitudes)> add;
};

struct Dictionary {
  Eigen::MatrixXd columns;  ///< rows × columns
  std::vector<Candidate> candidates;
};

/// All effects that act between torque and motion and are not in the model yet (cogging may be there several
/// times; its harmonics are found by ripple(), not here).
Dictionary make_dictionary(const FittedModel& fitted, const Rows& rows);

/// Dominant number of periods per turn in the residual, from its spectrum over position, refined by the
/// ripple's phase if the joint turned far; 0 if it does not turn far enough.
double ripple_periods_per_rev(const Eigen::VectorXd& residual, const Eigen::VectorXd& position_rad);
/// Columns sin(N·θ), cos(N·θ), of rows at these positions and velocities, as passed by the band.
Eigen::MatrixXd ripple_columns(double periods_per_rev, const Eigen::VectorXd& position_rad,
                               const Eigen::VectorXd& velocity_rad_per_s, double band_Hz);
/// The model with one additional cogging harmonic.
FittedModel with_ripple(const FittedModel& fitted, double periods_per_rev, double sine_Nm, double cosine_Nm);

}  // namespace identification::gap
