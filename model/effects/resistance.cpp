#include "model/effects/resistance.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <variant>

#include "model/effects/dissipation.h"
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
/// Assistance that grows with position drives the joint away if the stiffness is too large.
void add(model::PositionTorque& /*torque*/, const Spring& /*spring*/) {}
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
  const LeastFriction least(model);
  const auto sliding_Nm = [&least](double velocity_rad_per_s) {
    const double direction = std::copysign(1.0, velocity_rad_per_s);
    return direction * std::max(least.level_Nm(std::abs(velocity_rad_per_s), direction), 0.0);
  };
  model::JointResistance resistance{.sliding = {sliding_Nm, model::friction::kLawGrid}};
  for (const AnyEffect& any : model.effects)
    std::visit(
        [&resistance](const auto& effect) {
          using E = std::decay_t<decltype(effect)>;
          if constexpr (ActsOnPosition<E>) add(resistance.position, effect);
          if constexpr (std::is_same_v<E, ActuatorGain>)
            if (effect.parameters().gain != 1)
              throw std::invalid_argument(
                  "actuator_gain is " + std::to_string(effect.parameters().gain) +
                  ": correct the torque constant of the drive by this factor and remove "
                  "the effect; compensation would be wrong by as much");
          if constexpr (std::is_same_v<E, ActuatorOffset>)
            resistance.position.constant_Nm -= effect.parameters().torque_Nm;
          if constexpr (std::is_same_v<E, TorqueDeadband>)
            resistance.least_torque_Nm =
                std::max(resistance.least_torque_Nm, effect.parameters().threshold_Nm);
        },
        any);
  return resistance;
}

}  // namespace model::effects
