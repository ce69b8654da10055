/// @file
/// Fits effects to a steady-state map, and says which of its parameters the map decides.
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

/// A parameter of an effect, by the names in the library.
struct EffectParameter {
  std::string_view effect;
  std::string_view name;
  friend bool operator==(const EffectParameter&, const EffectParameter&) = default;
  friend bool operator<(const EffectParameter& a, const EffectParameter& b) {
    const int order = a.effect.compare(b.effect);
    return order != 0 ? order < 0 : a.name.compare(b.name) < 0;
  }
};

/// Those that show in a map.
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

/// What is fitted: the torque of these effects on a joint that slides steadily.
/// A torque offset and Coulomb friction that differs by direction are the same function of velocity: the map
/// cannot tell them apart.
///
///     form_named("kfm").add("torque_offset").give({"stribeck", "exponent"}, 1)
struct StaticForm {
  std::vector<model::effects::AnyEffect> effects;
  std::vector<EffectParameter> given{};  ///< keep their value, the others are fitted

  /// One more effect; of a direction asymmetry only the viscous part, as the other one is an offset.
  /// @throws std::invalid_argument listing the effects there are.
  StaticForm& add(std::string_view effect);
  /// @throws std::invalid_argument when the form does not have it, or the value is out of bounds.
  StaticForm& give(const EffectParameter& parameter, double value);
};

/// The effects whose torques add up to the steady curve of a friction law; none when there are no such
/// effects.
std::optional<StaticForm> form_of_law(const model::friction::LawDescription& law);
/// Those of a law by its name, and more: "kfm+offset+asymmetry+quadratic".
/// @throws std::invalid_argument naming what is unknown, or the law that has none.
StaticForm form_named(std::string_view text);
/// Such as "coulomb + viscous + stribeck + torque offset".
std::string form_name(const StaticForm& form);

struct StaticFitOptions {
  bool profile = true;  ///< intervals by profile where the covariance is not honest; false: covariance only
  bool leave_one_out = true;
  bool exclude_outliers = true;
  /// These points of the map are left out and no others, as it is comparing forms on the same points.
  std::optional<std::vector<std::size_t>> left_out{};
};

struct StaticFit {
  StaticForm form;
  /// Of all effects of the form in their order; those given with a reason why they have no interval.
  std::vector<Estimate> parameters;
  /// With all parameters, also those that are not identifiable: for prediction within the map only. Empty
  /// when nothing was fitted.
  std::vector<model::effects::AnyEffect> effects;
  double relative_error_percent = 0;  ///< of the points used
  double leave_one_out_percent = 0;   ///< each speed predicted from the others; NaN when not asked for
  double scatter_Nm = 0;              ///< 1 sigma beyond the measured intervals: repeatability and misfit
  double condition = 0;               ///< of the scaled Jacobian
  std::vector<std::size_t> outliers;  ///< indices of the map's points that were left out
  std::vector<std::string> verdicts;  ///< what the map as a whole does not allow to say
  bool ok() const noexcept { return !effects.empty(); }

  /// @throws std::logic_error when nothing was fitted
  double torque_Nm(double velocity_rad_per_s) const;
};

/// Weights: each point's variance is that of its measured interval plus a common scatter, found such that the
/// residuals are as large as they should be [R. C. Paule, J. Mandel, J. Res. NBS 87, 1982]: intervals from
/// repeats within one run know nothing of the difference between runs, and without intervals all points count
/// alike. Points improbable at 1 % for the whole map under a robust fit are left out and listed, at most a
/// fifth of them, and none when three neighbouring speeds are off to the same side, which is the form's fault
/// and becomes a verdict. Intervals: from the covariance where the form is linear in its parameters and no
/// bound is near, else where the profile of the sum of squares crosses the same level. A static torque is
/// never below the Coulomb torque: where the map would have it there, both are equal, nothing of a Stribeck
/// effect is identified and a verdict says so. Too few speeds give a fit without values and the reason in
/// verdicts.
/// @throws std::invalid_argument for a point at rest or that is not a number.
StaticFit fit_static(const StaticMap& map, const StaticForm& form, const StaticFitOptions& options = {});

}  // namespace identification::fit
