#include "analysis/sliding_fit.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <variant>

#include "identification/gap/regression.h"
#include "model/effects/effect_chain.h"
#include "model/friction/stribeck_curve.h"

namespace analysis {
namespace {

using model::effects::AnyEffect;
using model::effects::Coulomb;
using model::effects::DriveModel;
using model::effects::EffectChain;
using model::effects::FrictionLaw;
using model::effects::MidspeedDip;
using model::effects::QuadraticDrag;
using model::effects::Stribeck;
using model::effects::ThermalDrift;
using model::effects::Viscous;

/// A warm joint without load.
model::effects::Slide warm(double speed_rad_per_s, double direction) noexcept {
  return {.speed_rad_per_s = speed_rad_per_s,
          .direction = direction,
          .running_s = std::numeric_limits<double>::infinity()};
}
/// Velocities of bristles for a curve of another form: as shares of the highest speed, each half of the next.
constexpr int kVelocities = 7;
/// Bristles below this share of the friction at rest are noise of the fit.
constexpr double kLeastShare = 1e-3;

/// (Fs − Fc)·exp(−(v/vs)²) is LuGre's curve.
bool is_gaussian(const Stribeck& stribeck) {
  return stribeck.parameters().exponent == 2 && stribeck.parameters().tail == 0;
}

/// Whether coulomb, viscous, quadratic and one bristle for each Stribeck effect are this friction exactly.
bool is_exact(const DriveModel& model) {
  return std::ranges::all_of(model.effects, [](const AnyEffect& effect) {
    if (const auto* stribeck = std::get_if<Stribeck>(&effect)) return is_gaussian(*stribeck);
    return !std::holds_alternative<MidspeedDip>(effect) && !std::holds_alternative<FrictionLaw>(effect);
  });
}

/// A bristle of a positive or negative bump at rest.
Bristle bump(double at_rest_Nm, double velocity_rad_per_s) {
  return {std::max(-at_rest_Nm, 0.0), std::max(at_rest_Nm, 0.0), velocity_rad_per_s};
}

SlidingFit exact_fit(const DriveModel& model) {
  SlidingFit fit;
  double coulomb_Nm = 0;
  for (const AnyEffect& effect : model.effects)
    if (const auto* coulomb = std::get_if<Coulomb>(&effect)) coulomb_Nm += coulomb->parameters().torque_Nm;
  fit.coulomb_Nm = coulomb_Nm;
  for (const AnyEffect& effect : model.effects) {
    if (const auto* viscous = std::get_if<Viscous>(&effect))
      fit.viscous_Nm_s_per_rad += viscous->parameters().coefficient_Nm_s_per_rad;
    if (const auto* drag = std::get_if<QuadraticDrag>(&effect))
      fit.quadratic_Nm_s2_per_rad2 += drag->parameters().coefficient_Nm_s2_per_rad2;
    if (const auto* drift = std::get_if<ThermalDrift>(&effect)) {
      fit.coulomb_Nm += drift->parameters().coulomb_change_Nm;
      fit.viscous_Nm_s_per_rad += drift->parameters().viscous_change_Nm_s_per_rad;
    }
    if (const auto* stribeck = std::get_if<Stribeck>(&effect)) {
      fit.bristles.push_back(bump(stribeck->parameters().static_torque_Nm - coulomb_Nm,
                                  stribeck->parameters().velocity_rad_per_s));
      fit.coulomb_Nm -= fit.bristles.back().sliding_Nm;
    }
  }
  return fit;
}

/// Least squares with terms of which none is negative: then each of them brakes.
SlidingFit least_squares(const EffectChain& chain, std::span<const double> speeds, SlidingTerms terms) {
  const double fastest = std::max(*std::ranges::max_element(speeds), 1e-6);
  std::vector<double> velocities;
  if (terms == SlidingTerms::kAll)
    for (int k = 0; k < kVelocities; ++k) velocities.push_back(fastest * std::pow(0.5, k + 1));
  const auto count = static_cast<Eigen::Index>(speeds.size());
  const auto bristles = static_cast<Eigen::Index>(velocities.size());
  const Eigen::Index polynomial = terms == SlidingTerms::kAll ? 3 : 2;
  Eigen::MatrixXd columns(count, polynomial + 2 * bristles);
  Eigen::VectorXd level(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double v = speeds[static_cast<std::size_t>(i)];
    level[i] = (chain.level_Nm(warm(v, 1)) + chain.level_Nm(warm(v, -1))) / 2;
    for (Eigen::Index k = 0; k < polynomial; ++k) columns(i, k) = std::pow(v, static_cast<double>(k));
    for (Eigen::Index k = 0; k < bristles; ++k) {
      const double at_rest = model::friction::stribeck_share(v / velocities[static_cast<std::size_t>(k)], 2);
      columns(i, polynomial + 2 * k) = at_rest;
      columns(i, polynomial + 2 * k + 1) = 1 - at_rest;
    }
  }
  const std::vector<identification::gap::Bounds> bounds(static_cast<std::size_t>(columns.cols()),
                                                        {.lower = 0});
  const Eigen::VectorXd x = identification::gap::bounded_solution(columns.transpose() * columns,
                                                                  columns.transpose() * level, bounds);
  SlidingFit fit{.coulomb_Nm = x[0], .viscous_Nm_s_per_rad = x[1]};
  if (polynomial == 3) fit.quadratic_Nm_s2_per_rad2 = x[2];
  for (Eigen::Index k = 0; k < bristles; ++k) {
    // What it has at rest and in motion is Coulomb friction.
    const double rest_Nm = x[polynomial + 2 * k];
    const double sliding_Nm = x[polynomial + 2 * k + 1];
    fit.coulomb_Nm += std::min(rest_Nm, sliding_Nm);
    if (std::abs(rest_Nm - sliding_Nm) > kLeastShare * level.maxCoeff())
      fit.bristles.push_back(bump(rest_Nm - sliding_Nm, velocities[static_cast<std::size_t>(k)]));
  }
  return fit;
}

/// Half of the difference between the directions is a constant torque as far as it does not change with
/// speed.
double mean_asymmetry_Nm(const EffectChain& chain, std::span<const double> speeds) {
  double sum = 0;
  for (const double v : speeds) sum += (chain.level_Nm(warm(v, 1)) - chain.level_Nm(warm(v, -1))) / 2;
  return sum / static_cast<double>(speeds.size());
}

void measure_error(SlidingFit& fit, const EffectChain& chain, std::span<const double> speeds) {
  double squares = 0;
  for (const double v : speeds)
    for (const double direction : {1.0, -1.0}) {
      const double error = fit.level_Nm(v) + direction * fit.offset_Nm - chain.level_Nm(warm(v, direction));
      squares += error * error;
      if (std::abs(error) > std::abs(fit.worst_error_Nm)) {
        fit.worst_error_Nm = error;
        fit.worst_at_rad_per_s = direction * v;
      }
    }
  fit.rms_error_Nm = std::sqrt(squares / static_cast<double>(2 * speeds.size()));
}

}  // namespace

double SlidingFit::level_Nm(double speed_rad_per_s) const noexcept {
  double level =
      coulomb_Nm + speed_rad_per_s * (viscous_Nm_s_per_rad + speed_rad_per_s * quadratic_Nm_s2_per_rad2);
  for (const Bristle& one : bristles)
    level +=
        one.sliding_Nm + (one.rest_Nm - one.sliding_Nm) *
                             model::friction::stribeck_share(speed_rad_per_s / one.velocity_rad_per_s, 2);
  return level;
}

std::vector<double> speeds_to_fit_rad_per_s(std::vector<double> recorded_rad_per_s, double top_rad_per_s) {
  if (!recorded_rad_per_s.empty()) return recorded_rad_per_s;
  constexpr int kSpeeds = 400;
  std::vector<double> speeds;
  for (int i = 0; i <= kSpeeds; ++i) speeds.push_back(top_rad_per_s * i / kSpeeds);
  return speeds;
}

SlidingFit fit_sliding(const DriveModel& model, std::span<const double> speeds, SlidingTerms terms) {
  const EffectChain chain(model.effects);
  SlidingFit fit;
  if (terms == SlidingTerms::kAll && is_exact(model)) fit = exact_fit(model);
  // A warm drive may have less than no Coulomb friction in the exact terms.
  if (terms != SlidingTerms::kAll || !is_exact(model) || fit.coulomb_Nm < 0 || fit.viscous_Nm_s_per_rad < 0 ||
      fit.quadratic_Nm_s2_per_rad2 < 0)
    fit = least_squares(chain, speeds, terms);
  if (terms == SlidingTerms::kAll) fit.offset_Nm = mean_asymmetry_Nm(chain, speeds);
  measure_error(fit, chain, speeds);
  return fit;
}

}  // namespace analysis
