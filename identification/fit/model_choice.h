/// @file
/// Selects the terms that a steady-state map supports, so that a fit contains no spurious effect.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "identification/fit/static_fit.h"

namespace identification::fit {

/// Such as "torque offset or direction asymmetry".
std::string term_name(const EffectParameter& term);

struct ChoiceOptions {
  /// Probability that a search adds a term to a map that contains no further term.
  double false_positive_rate = 0.01;
  int repetitions = 999;
  std::uint64_t seed = 1;
  /// Friction must brake up to this speed, and up to the fastest speed of the map.
  double top_speed_rad_per_s = 0;
};

struct ChoiceStep {
  EffectParameter term{};
  bool added = false;    ///< otherwise considered and left out, or removed again
  bool removal = false;  ///< the step tests whether a present term can be removed
  /// StaticFit::leave_one_out_percent of the fits without and with the term, on the same points.
  double held_out_before_percent = 0;
  double held_out_after_percent = 0;
  double p_value = 1;
  bool drives = false;  ///< left out because friction would drive the joint at some speed with it
};
struct ModelChoice {
  StaticForm form;
  std::vector<EffectParameter> terms;
  std::vector<std::size_t> outliers;  ///< StaticFitOptions::left_out for this fit
  std::vector<ChoiceStep> steps;      ///< in the order of the decisions
  std::vector<std::string> verdicts;  ///< e.g. that the map was too small to choose
};

/// A term is a fitted parameter, including the effect it belongs to if it is an amplitude. The search begins
/// with Coulomb + viscous friction and adds, one by one, the term with the least held-out error, as long as
/// its gain exceeds chance.
///
/// Held out: a fit to all other speeds predicts each speed. This includes the Stribeck velocity and exponent,
/// which are selected from a grid again for each, so nothing of a point is in its own prediction. Chance:
/// `repetitions` maps are made from the simpler model and its own residuals (studentised, drawn with
/// replacement, random signs) and the whole search is repeated on each: every candidate, every grid point.
/// The term is added if at most `false_positive_rate` of these maps gain as much, relative to their own
/// error, as the measured one. This needs no noise level and no table: the repetitions account for the
/// Stribeck velocity, which does not exist in a model without the term and invalidates the usual F and
/// likelihood tests [R. B. Davies, Biometrika 74, 1987], and for the choice among several terms. A Stribeck
/// term is always a peak: a downward bend at low speed is not one, and neither Coulomb nor viscous friction
/// is negative. A term must also lower the reported figure, leave_one_out_percent of fit_static(), and leave
/// a law that brakes at all speeds up to the maximum. After each addition the other terms are tested the same
/// way and removed if they no longer help. Weights and outliers are those of fit_static() with all terms.
/// Deterministic for a seed.
/// @throws std::invalid_argument as fit_static().
ModelChoice choose_model(const StaticMap& map, const ChoiceOptions& options = {});

}  // namespace identification::fit
