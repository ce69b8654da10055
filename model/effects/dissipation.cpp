#include "model/effects/dissipation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <variant>

#include "model/effects/effect_chain.h"
#include "model/friction/dissipation.h"

namespace model::effects {

namespace {

/// Without gear losses and torques without a name, and with friction by place at its least.
std::vector<AnyEffect> named_at_their_least(const std::vector<AnyEffect>& effects) {
  std::vector<AnyEffect> result;
  for (const AnyEffect& any : effects) {
    if (std::holds_alternative<LoadFriction>(any) || std::holds_alternative<Empirical>(any)) continue;
    if (const auto* friction = std::get_if<PositionFriction>(&any))
      result.emplace_back(PositionFriction({.amplitude_Nm = friction->parameters().amplitude_Nm,
                                            .phase_rad = -0.5 * std::numbers::pi}));  // at position 0
    else
      result.push_back(any);
  }
  return result;
}

std::vector<Empirical> unnamed_of(const std::vector<AnyEffect>& effects) {
  std::vector<Empirical> result;
  for (const AnyEffect& any : effects)
    if (const auto* empirical = std::get_if<Empirical>(&any)) result.push_back(*empirical);
  return result;
}

/// Over a turn, and over the ranges of tables over the position.
double largest_load_Nm(const DriveModel& model) {
  constexpr int kPlaces = 20'000;
  double from = 0;
  double to = 2 * std::numbers::pi;
  for (const Empirical& empirical : unnamed_of(model.effects))
    for (const Empirical::Term& term : empirical.terms())
      if (term.along == Empirical::Along::kPosition) {
        from = std::min(from, term.table.from());
        to = std::max(to, term.table.to());
      }
  const EffectChain effects(model.effects);
  double largest = 0;
  for (int i = 0; i <= kPlaces; ++i)
    largest = std::max(largest, std::abs(effects.load_Nm(from + (to - from) * i / kPlaces)));
  return largest;
}

}  // namespace

LeastFriction::LeastFriction(const DriveModel& model)
    : named_(named_at_their_least(model.effects)),
      unnamed_(unnamed_of(model.effects)),
      largest_load_Nm_(largest_load_Nm(model)) {}

double LeastFriction::level_Nm(double speed_rad_per_s, double direction) const noexcept {
  const auto after = [&](double running_s) {
    return named_.signed_level_Nm(
        {.speed_rad_per_s = speed_rad_per_s, .direction = direction, .running_s = running_s});
  };
  double level = std::min(after(0), after(std::numeric_limits<double>::infinity()));
  for (const Empirical& empirical : unnamed_)
    level += empirical.least_level_Nm(speed_rad_per_s, direction, largest_load_Nm_);
  return level;
}

std::optional<double> driving_velocity_rad_per_s(const DriveModel& model, double top_speed_rad_per_s) {
  const LeastFriction least(model);
  const auto friction_Nm = [&least](double velocity_rad_per_s) {
    const double direction = std::copysign(1.0, velocity_rad_per_s);
    return direction * least.level_Nm(std::abs(velocity_rad_per_s), direction);
  };
  return model::friction::driving_velocity_rad_per_s(friction_Nm, top_speed_rad_per_s);
}

}  // namespace model::effects
