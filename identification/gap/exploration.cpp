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
constexpr std::array kStartLosses_s_per_rad{1.0, 3.0};

using Direction = std::span<const model::effects::NamedValue>;  // a parameter and its power of the step

constexpr std::array kWider{model::effects::NamedValue{"gap_rad", 1}};
constexpr std::array kRubsMore{model::effects::NamedValue{"friction_ratio", 1}};
/// The load's friction is unchanged.
constexpr std::array kHeavier{model::effects::NamedValue{"load_share", 1},
                              model::effects::NamedValue{"friction_ratio", -1}};
constexpr std::array kBouncesLess{model::effects::NamedValue{"impact_loss_s_per_rad", 2}};
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
FittedModel best_start(const FittedModel& fitted, const Rows& rows, const std::vector<Eigen::Index>& use) {
  FittedModel best = fitted;
  double least = square_of(best, rows, use);
  for (const double wider : kStartsWider)
    for (const double share : kStartShares)
      for (const double ratio : kStartFrictionRatios)
        for (const double loss : kStartLosses_s_per_rad) {
          FittedModel trial = with_gap(fitted, rows, [&](const FreeParameter& p) {
            return p.name == "gap_rad"          ? wider * p.value
                   : p.name == "load_share"     ? share
                   : p.name == "friction_ratio" ? ratio
                                                : loss;
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
  return refined(explored(best_start(fitted, rows, use), rows, use), rows, use);
}

}  // namespace identification::gap
