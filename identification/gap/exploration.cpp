#include "identification/gap/exploration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace identification::gap {
namespace {

constexpr double kFirstStep = 1.25;
constexpr double kLastStep = 1.02;
constexpr int kMostTours = 40;
constexpr int kMostTurns = 4;
/// Share of the square that is left, at most, for another turn.
constexpr double kWorthATurn = 0.95;

using Direction = std::span<const model::effects::NamedValue>;  // a parameter and its power of the step

constexpr std::array kWider{model::effects::NamedValue{"gap_rad", 1}};
constexpr std::array kRubsMore{model::effects::NamedValue{"friction_ratio", 1}};
/// The load's friction stays.
constexpr std::array kHeavier{model::effects::NamedValue{"load_share", 1},
                              model::effects::NamedValue{"friction_ratio", -1}};
constexpr std::array kBouncesLess{model::effects::NamedValue{"impact_loss_s_per_rad", 2}};
constexpr std::array<Direction, 4> kDirections{kWider, kHeavier, kRubsMore, kBouncesLess};

FittedModel gone(const FittedModel& fitted, const Rows& rows, Direction direction, double step) {
  FittedModel result = fitted;
  for (const FreeParameter& p : free_parameters(fitted, rows)) {
    if (p.kind != FreeParameter::Kind::kEffect ||
        !std::holds_alternative<model::effects::Backlash>(fitted.model.effects[p.effect]))
      continue;
    for (const auto& [name, power] : direction)
      if (p.name == name) result = with_value(result, p, p.value * std::pow(step, power));
  }
  return result;
}

double square_of(const FittedModel& fitted, const Rows& rows, const std::vector<Eigen::Index>& use) {
  return (rows.torque_Nm() - predicted_rows(fitted, rows))(use).squaredNorm();
}

FittedModel explored(const FittedModel& fitted, const Rows& rows, const std::vector<Eigen::Index>& use) {
  FittedModel best = fitted;
  double least = square_of(best, rows, use);
  double step = kFirstStep;
  for (int tour = 0; tour < kMostTours && step > kLastStep; ++tour) {
    const double before = least;
    for (const Direction& direction : kDirections) {
      for (const double way : {step, 1 / step}) {
        FittedModel trial = gone(best, rows, direction, way);
        const double left = square_of(trial, rows, use);
        if (left >= least) continue;
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
  double least = square_of(best, rows, use);
  for (int turn = 0; turn < kMostTurns; ++turn) {
    FittedModel next = refined(explored(best, rows, use), rows, use);
    const double left = square_of(next, rows, use);
    const bool much = left < kWorthATurn * least;
    if (left < least) {
      best = std::move(next);
      least = left;
    }
    if (!much) break;
  }
  return best;
}

}  // namespace identification::gap
