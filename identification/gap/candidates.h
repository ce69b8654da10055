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

/// Once per turn, a torque is an imbalance.
inline constexpr double kMinRipplePeriods = 1.5;

struct Dictionary {
  Eigen::MatrixXd columns;  ///< rows × columns
  std::vector<Candidate> candidates;
};

/// All effects that act between torque and motion and are not in the model yet (without those that repeat
/// over position: they may be there several times; their harmonics are found by Ripple, not here).
Dictionary make_dictionary(const FittedModel& fitted, const Rows& rows);

/// Dominant number of periods per turn in the residual, from its spectrum over position, refined by the
/// ripple's phase if the joint turned far; 0 if it does not turn far enough, or if nothing is left at `least`
/// or more periods per turn and beside those that are `known`.
double ripple_periods_per_rev(const Eigen::VectorXd& residual, const Eigen::VectorXd& position_rad,
                              double least = kMinRipplePeriods, const std::vector<double>& known = {});

/// An effect that repeats over position: the torque factor·A·sin(N·θ + φ), or for an error of the encoder
/// A·(N²·factor·sin(N·θ + φ) − N·first_order·cos(N·θ + φ)).
struct Ripple {
  std::string_view effect;
  std::string_view amplitude;  ///< its parameter A
  double least_periods_per_rev;
  Eigen::VectorXd factor;       ///< of each row
  Eigen::VectorXd first_order;  ///< likewise; empty unless it is an error of the encoder
};
std::vector<Ripple> ripples(const FittedModel& fitted, const Rows& rows);
/// Columns for the amplitudes A·cos φ, A·sin φ, of rows at these positions and velocities, as passed by the
/// band.
Eigen::MatrixXd ripple_columns(const Ripple& ripple, double periods_per_rev,
                               const Eigen::VectorXd& position_rad, const Eigen::VectorXd& velocity_rad_per_s,
                               double band_Hz);
/// The model with one additional harmonic.
FittedModel with_ripple(const FittedModel& fitted, const Ripple& ripple, double periods_per_rev, double sine,
                        double cosine);
/// Periods per turn of the harmonics of an effect that the model has.
std::vector<double> known_periods(const FittedModel& fitted, std::string_view effect);

}  // namespace identification::gap
