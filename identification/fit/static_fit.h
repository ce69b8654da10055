/// @file
/// Fits effects to a steady-state map, and reports which parameters the map determines.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "identification/fit/static_map.h"
#include "identification/fit/statistics.h"
#include "model/effects/any_effect.h"
#include "model/friction/any_law.h"

namespace identification::fit {

/// A parameter of an effect, by its names in the library.
struct EffectParameter {
  std::string_view effect;
  std::string_view name;
  friend bool operator==(const EffectParameter&, const EffectParameter&) = default;
  friend bool operator<(const EffectParameter& a, const EffectParameter& b) {
    const int order = a.effect.compare(b.effect);
    return order != 0 ? order < 0 : a.name.compare(b.name) < 0;
  }
};

/// Terms that are visible in a map.
namespace terms {
inline constexpr EffectParameter kCoulomb{"coulomb", "torque_Nm"};
inline constexpr EffectParameter kViscous{"viscous", "coefficient_Nm_s_per_rad"};
inline constexpr EffectParameter kTorqueOffset{"torque_offset", "torque_Nm"};
inline constexpr EffectParameter kConstantAsymmetry{"direction_asymmetry", "coulomb_Nm"};
inline constexpr EffectParameter kViscousAsymmetry{"direction_asymmetry", "viscous_Nm_s_per_rad"};
inline constexpr EffectParameter kQuadratic{"quadratic_drag", "coefficient_Nm_s2_per_rad2"};
inline constexpr EffectParameter kStribeck{"stribeck", "static_torque_Nm"};
inline constexpr EffectParameter kStribeckVelocity{"stribeck", "velocity_rad_per_s"};
inline constexpr EffectParameter kStribeckExponent{"stribeck", "exponent"};
inline constexpr EffectParameter kStribeckTail{"stribeck", "tail"};
}  // namespace terms

/// The fitted form: the torque of these effects on a steadily sliding joint. A torque offset and
/// direction-dependent Coulomb friction are the same function of velocity: the map cannot distinguish them.
///
///     form_named("kfm").add("torque_offset").give({"stribeck", "exponent"}, 1)
struct StaticForm {
  std::vector<model::effects::AnyEffect> effects;
  std::vector<EffectParameter> given{};  ///< these keep their value, the others are fitted

  /// One more effect; for a direction asymmetry only the viscous part, because the other one is an offset.
  /// @throws std::invalid_argument listing the known effects.
  StaticForm& add(std::string_view effect);
  /// @throws std::invalid_argument if the form does not have it, or the value is out of bounds.
  StaticForm& give(const EffectParameter& parameter, double value);
};

/// The effects whose torques add up to the steady curve of a friction law; empty if there are none.
std::optional<StaticForm> form_of_law(const model::friction::LawDescription& law);
/// The form of a law by name, with further effects: "kfm+offset+asymmetry+quadratic".
/// @throws std::invalid_argument naming what is unknown, or the law without a form.
StaticForm form_named(std::string_view text);
/// For example "coulomb + viscous + stribeck + torque offset".
std::string form_name(const StaticForm& form);

struct StaticFitOptions {
  bool profile = true;  ///< intervals by profile where the covariance is not valid; false: covariance only
  bool leave_one_out = true;
  bool exclude_outliers = true;
  /// Exactly these points of the map are left out, as needed to compare forms on the same points.
  std::optional<std::vector<std::size_t>> left_out{};
};

struct StaticFit {
  StaticForm form;
  /// Parameters of all effects of the form, in order; given ones have a reason why they have no interval.
  std::vector<Estimate> parameters;
  /// With all parameters, including those that are not identifiable: for prediction within the map only.
  /// Empty if nothing was fitted.
  std::vector<model::effects::AnyEffect> effects;
  double relative_error_percent = 0;  ///< of the points used
  double leave_one_out_percent = 0;   ///< each speed predicted from the others; NaN if not requested
  double scatter_Nm = 0;              ///< 1 sigma beyond the measured intervals: repeatability and misfit
  double condition = 0;               ///< of the scaled Jacobian
  std::vector<std::size_t> outliers;  ///< indices of the map's points that were left out
  std::vector<std::string> verdicts;  ///< limits of what the map as a whole can show
  bool ok() const noexcept { return !effects.empty(); }

  /// @throws std::logic_error if nothing was fitted
  double torque_Nm(double velocity_rad_per_s) const;
};

/// Weights: each point's variance is that of its measured interval plus a common scatter, such that the
/// residuals have the expected size [R. C. Paule, J. Mandel, J. Res. NBS 87, 1982]: intervals from repeats
/// within one run do not include differences between runs, and without intervals all points have equal
/// weight. Points that are improbable at 1 % for the whole map under a robust fit are left out and listed, at
/// most a fifth of them; none if three neighbouring speeds deviate to the same side, which is a misfit of the
/// form and becomes a verdict. Intervals: from the covariance if the form is linear in its parameters and no
/// bound is near, otherwise where the profile of the sum of squares crosses the same level. A static torque
/// is never below the Coulomb torque: where the map would have it there, both are equal, nothing of a
/// Stribeck effect is identified and a verdict says so. Too few speeds give a fit without values and the
/// reason in verdicts.
/// @throws std::invalid_argument for a point at rest or a non-finite value.
StaticFit fit_static(const StaticMap& map, const StaticForm& form, const StaticFitOptions& options = {});

}  // namespace identification::fit
