/// @file
/// Which terms a steady-state map supports, so that a fit names no effect that is not there.
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
  /// How often a search adds a term to a map that has none more than it found already.
  double false_positive_rate = 0.01;
  int repetitions = 999;
  std::uint64_t seed = 1;
  /// Friction must brake up to here, and up to the fastest speed of the map.
  double top_speed_rad_per_s = 0;
};

struct ChoiceStep {
  EffectParameter term{};
  bool added = false;    ///< else considered and left out, or taken out again
  bool removal = false;  ///< asked whether a term that is in may go
  /// StaticFit::leave_one_out_percent of the fits without and with the term, of the same points.
  double held_out_before_percent = 0;
  double held_out_after_percent = 0;
  double p_value = 1;
  bool drives = false;  ///< left out because with it friction would drive the joint at some speed
};
struct ModelChoice {
  StaticForm form;
  std::vector<EffectParameter> terms;
  std::vector<std::size_t> outliers;  ///< StaticFitOptions::left_out of the fit that is meant
  std::vector<ChoiceStep> steps;      ///< in the order they were decided
  std::vector<std::string> verdicts;  ///< such as that the map was too small to choose
};

/// A term is a parameter that is fitted, and with an amplitude the effect that has it. Begins with Coulomb +
/// viscous friction and adds, one by one, the term with the least held-out error, as
/// long as its gain is more than chance gives.
///
/// Held out: each speed is predicted by a fit to all others. That includes the Stribeck velocity and
/// exponent, which are chosen from a grid anew for each, so nothing of a point is in its own prediction.
/// Chance: `repetitions` maps are made from the simpler model and its own residuals (studentised, drawn with
/// replacement, signs thrown) and the whole search is repeated on each: every candidate, every grid point.
/// The term is added when not more than `false_positive_rate` of these maps gain as much, relative to their
/// own error, as the measured one. This needs no noise level and no table: that the Stribeck velocity does
/// not exist in a model without the term, which spoils the usual F and likelihood tests [R. B. Davies,
/// Biometrika 74, 1987], is in the repetitions, and so is the choice among several terms. A Stribeck term
/// is a peak, in every fit: what bends the curve down at low speed is none, and no Coulomb or viscous
/// friction is negative. A term must also lower the figure that is reported, leave_one_out_percent of
/// fit_static(), and leave a law that brakes at all speeds up to the top one. After each addition the other
/// terms are asked the same questions and leave when they no longer serve. Weights and outliers as
/// fit_static() finds them with all terms. Deterministic for a seed.
/// @throws std::invalid_argument as fit_static().
ModelChoice choose_model(const StaticMap& map, const ChoiceOptions& options = {});

}  // namespace identification::fit
