#include "model/effects/resistance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <variant>
#include <vector>

#include "model/effects/dissipation.h"
#include "model/effects/effect_chain.h"
#include "model/friction/law_compensator.h"

namespace model::effects {
namespace {

void add(model::PositionTorque& torque, const TorqueOffset& offset) {
  torque.constant_Nm += offset.parameters().torque_Nm;
}
void add(model::PositionTorque& torque, const Imbalance& imbalance) {
  const ImbalanceParameters& p = imbalance.parameters();
  torque.harmonics.push_back({p.torque_Nm, 1, -p.rest_position_rad});
}
void add(model::PositionTorque& torque, const Cogging& cogging) {
  const CoggingParameters& p = cogging.parameters();
  torque.harmonics.push_back({p.amplitude_Nm, p.periods_per_rev, p.phase_rad});
}
void add(model::PositionTorque& torque, const Custom& custom) {
  if (custom.kind().load != nullptr)
    torque.functions.push_back({custom.amplitude(), custom.shape(), custom.kind().load});
}

void add(model::PositionTorque& torque, const Empirical& empirical) {
  for (const Empirical::Term& term : empirical.terms())
    if (term.is_load()) torque.tables.push_back(term.table);
}

}  // namespace

model::JointResistance resistance_of(const DriveModel& model) {
  std::vector<AnyEffect> named = with_least_friction(model.effects);
  std::vector<Empirical> unnamed;
  for (const AnyEffect& any : named)
    if (const auto* empirical = std::get_if<Empirical>(&any)) unnamed.push_back(*empirical);
  std::erase_if(named, [](const AnyEffect& any) { return std::holds_alternative<Empirical>(any); });
  const EffectChain effects(named);
  const auto sliding_Nm = [&](double velocity_rad_per_s) {
    const double direction = std::copysign(1.0, velocity_rad_per_s);
    const double speed = std::abs(velocity_rad_per_s);
    const auto after = [&](double running_s) {
      double level =
          effects.signed_level_Nm({.speed_rad_per_s = speed, .direction = direction, .running_s = running_s});
      for (const Empirical& empirical : unnamed) level += empirical.least_level_Nm(speed, direction);
      return std::max(level, 0.0);
    };
    return direction * std::min(after(0), after(std::numeric_limits<double>::infinity()));
  };
  model::JointResistance resistance{.sliding = {sliding_Nm, model::friction::kLawGrid}};
  for (const AnyEffect& any : model.effects)
    std::visit(
        [&resistance](const auto& effect) {
          using E = std::decay_t<decltype(effect)>;
          if constexpr (ActsOnPosition<E>) add(resistance.position, effect);
          if constexpr (std::is_same_v<E, TorqueDeadband>)
            resistance.least_torque_Nm =
                std::max(resistance.least_torque_Nm, effect.parameters().threshold_Nm);
        },
        any);
  return resistance;
}

}  // namespace model::effects
