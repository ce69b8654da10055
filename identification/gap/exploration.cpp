#include "identification/gap/exploration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace identification::gap {
namespace {

constexpr double kFirstStep = 1.25;
constexpr double kLastStep = 1.02;
constexpr int kMaxTours = 20;

/// Factors on the gap that the linear estimate prefers.
constexpr std::array kStartsWider{0.8, 0.9, 1.0, 1.12, 1.25, 1.4, 1.6, 1.8, 2.0};
constexpr std::array kStartShares{0.3, 0.45};
constexpr std::array kStartFrictionRatios{0.7, 1.3};
/// Of the speed with which the flanks collide: a loss that grows with it, or the same share at each.
struct Rebound {
  double impact_loss_s_per_rad;
  double damping_ratio;
};
/// The fit does not find from one kind to the other.
constexpr std::array kLossAtSpeed{Rebound{1, 0}, Rebound{3, 0}};
constexpr std::array kSameShare{Rebound{0, 0.1}, Rebound{0, 0.4}};

using Direction = std::span<const model::effects::NamedValue>;  // a parameter and its power of the step

constexpr std::array kWider{model::effects::NamedValue{"gap_rad", 1}};
constexpr std::array kRubsMore{model::effects::NamedValue{"friction_ratio", 1}};
/// The load's friction is unchanged.
constexpr std::array kHeavier{model::effects::NamedValue{"load_share", 1},
                              model::effects::NamedValue{"friction_ratio", -1}};
constexpr std::array kBouncesLess{model::effects::NamedValue{"impact_loss_s_per_rad", 2},
                                  model::effects::NamedValue{"damping_ratio", 2}};
constexpr std::array<Direction, 4> kDirections{kWider, kHeavier, kRubsMore, kBouncesLess};

/// `fitted` with each parameter of its gap changed by `change`.
template <class Change>
FittedModel with_gap(const FittedModel& fitted, const Rows& rows, const Change& change) {
  FittedModel result = fitted;
  for (const FreeParameter& p : free_parameters(fitted, rows)) {
    if (p.kind != FreeParameter::Kind::kEffect ||
        !std::holds_alternative<model::effects::Backlash>(fitted.model.effects[p.effect]))
      continue;
    result = with_value(result, p, change(p));
  }
  return result;
}

FittedModel gone(const FittedModel& fitted, const Rows& rows, Direction direction, double step) {
  return with_gap(fitted, rows, [&](const FreeParameter& p) {
    for (const auto& [name, power] : direction)
      if (p.name == name) return p.value * std::pow(step, power);
    return p.value;
  });
}

double square_of(const FittedModel& fitted, const Rows& rows, const std::vector<Eigen::Index>& use) {
  return (rows.torque_Nm() - predicted_rows(fitted, rows))(use).squaredNorm();
}

/// The best of a coarse grid, by predictions only.
FittedModel best_start(const FittedModel& fitted, const Rows& rows, const std::vector<Eigen::Index>& use,
                       std::span<const Rebound> rebounds) {
  FittedModel best = fitted;
  double least = square_of(best, rows, use);
  for (const double wider : kStartsWider)
    for (const double share : kStartShares)
      for (const double ratio : kStartFrictionRatios)
        for (const Rebound& rebound : rebounds) {
          FittedModel trial = with_gap(fitted, rows, [&](const FreeParameter& p) {
            return p.name == "gap_rad"                 ? wider * p.value
                   : p.name == "load_share"            ? share
                   : p.name == "friction_ratio"        ? ratio
                   : p.name == "impact_loss_s_per_rad" ? rebound.impact_loss_s_per_rad
                                                       : rebound.damping_ratio;
          });
          const double left = square_of(trial, rows, use);
          if (!(left < least)) continue;
          best = std::move(trial);
          least = left;
        }
  return best;
}

FittedModel explored(const FittedModel& fitted, const Rows& rows, const std::vector<Eigen::Index>& use) {
  FittedModel best = fitted;
  double least = square_of(best, rows, use);
  double step = kFirstStep;
  for (int tour = 0; tour < kMaxTours && step > kLastStep; ++tour) {
    const double before = least;
    for (const Direction& direction : kDirections) {
      for (const double way : {step, 1 / step}) {
        FittedModel trial = gone(best, rows, direction, way);
        const double left = square_of(trial, rows, use);
        if (!(left < least)) continue;
        best = std::move(trial);
        least = left;
        break;
      }
    }
    if (least == before) step = std::sqrt(step);
  }
  return best;
}

}  // namespace

FittedModel refined_widely(const FittedModel& fitted, const Rows& rows,
                           const std::vector<Eigen::Index>& use) {
  if (fitted.model.find<model::effects::Backlash>() == nullptr) return refined(fitted, rows, use);
  FittedModel best = fitted;
  double least = square_of(fitted, rows, use);
  for (const std::span<const Rebound> rebounds : {std::span(kLossAtSpeed), std::span(kSameShare)}) {
    FittedModel trial = refined(explored(best_start(fitted, rows, use, rebounds), rows, use), rows, use);
    const double left = square_of(trial, rows, use);
    if (!(left < least)) continue;
    best = std::move(trial);
    least = left;
  }
  return best;
}

}  // namespace identification::gap
