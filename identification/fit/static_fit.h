/// @file
/// Fits a friction law to a steady-state map, and says which of its parameters the map decides.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "identification/fit/static_map.h"
#include "identification/fit/statistics.h"
#include "model/friction/any_law.h"

namespace identification::fit {

/// What is fitted:  F(v) = law(v) + offset + d·|v| + q·v·|v|
/// A torque offset and Coulomb friction that differs by direction are the same function of velocity: the map
/// cannot tell them apart. Viscous friction that differs by direction is d.
struct StaticForm {
  std::string law = "kfm";  ///< any of model::friction::law_descriptions(); its steady_Nm()
  bool torque_offset = false;
  bool viscous_asymmetry = false;
  bool quadratic = false;
  /// Parameters of the law that are given rather than fitted.
  std::vector<std::pair<std::string, double>> fixed{};
};
inline constexpr std::string_view kTorqueOffsetName = "torque_offset_Nm";
inline constexpr std::string_view kViscousAsymmetryName = "viscous_asymmetry_Nm_s_per_rad";
inline constexpr std::string_view kQuadraticName = "quadratic_Nm_s2_per_rad2";

/// Such as "kfm + torque offset".
std::string form_name(const StaticForm& form);

struct StaticFitOptions {
  bool profile = true;  ///< intervals by profile where the covariance is not honest; false: covariance only
  bool leave_one_out = true;
  bool exclude_outliers = true;
  /// These points of the map are left out and no others, as it is comparing laws on the same points.
  std::optional<std::vector<std::size_t>> left_out{};
};

struct StaticFit {
  StaticForm form;
  /// The law's in the order of its description (the fixed ones with a reason why they have no interval), then
  /// offset, asymmetry and quadratic term as far as the form has them.
  std::vector<Estimate> parameters;
  /// All of them as numbers, also those that are not identifiable: for prediction within the map only.
  std::vector<double> values;
  double relative_error_percent = 0;  ///< of the points used
  double leave_one_out_percent = 0;   ///< each speed predicted from the others; NaN when not asked for
  double scatter_Nm = 0;              ///< 1 sigma beyond the measured intervals: repeatability and misfit
  double condition = 0;               ///< of the scaled Jacobian
  std::vector<std::size_t> outliers;  ///< indices of the map's points that were left out
  std::vector<std::string> verdicts;  ///< what the map as a whole does not allow to say
  bool ok() const noexcept { return !values.empty(); }

  /// @throws std::logic_error when nothing was fitted
  double torque_Nm(double velocity_rad_per_s) const;
  /// @throws std::invalid_argument when the form does not have it
  const Estimate& parameter(std::string_view name) const;
};

/// The velocity nearest to rest at which the fitted friction drives the joint, as
/// model::friction::driving_velocity_rad_per_s(); a torque offset is no friction and does not count.
std::optional<double> driving_velocity_rad_per_s(const StaticFit& fit, double top_speed_rad_per_s);

/// Weights: each point's variance is that of its measured interval plus a common scatter, found such that the
/// residuals are as large as they should be [R. C. Paule, J. Mandel, J. Res. NBS 87, 1982]: intervals from
/// repeats within one run know nothing of the difference between runs, and without intervals all points count
/// alike. Points improbable at 1 % for the whole map under a robust fit are left out and listed, at most a
/// fifth of them, and none when three neighbouring speeds are off to the same side, which is the law's fault
/// and becomes a verdict. Intervals: from the covariance where the form is linear in its parameters and no
/// bound is near, else where the profile of the sum of squares crosses the same level. A static torque is
/// never below the Coulomb torque: where the map would have it there, both are equal, nothing of a Stribeck
/// effect is identified and a verdict says so. Too few speeds give a fit without values and the reason in
/// verdicts.
/// @throws std::invalid_argument for an unknown law or fixed parameter, or a point at rest or that is not a
///         number.
StaticFit fit_static(const StaticMap& map, const StaticForm& form, const StaticFitOptions& options = {});

}  // namespace identification::fit
