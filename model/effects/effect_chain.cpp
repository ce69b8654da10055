#include "model/effects/effect_chain.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <variant>

namespace model::effects {
namespace {

/// std::visit that cannot throw: these variants are never valueless.
template <std::size_t kIndex = 0, class Visit>
void ask(const AnyEffect& effect, const Visit& of) noexcept {
  if constexpr (kIndex < std::variant_size_v<AnyEffect>) {
    if (const auto* found = std::get_if<kIndex>(&effect))
      of(*found);
    else
      ask<kIndex + 1>(effect, of);
  }
}

}  // namespace

EffectChain::EffectChain(std::span<const AnyEffect> effects) : effects_(effects.begin(), effects.end()) {
  for (const AnyEffect& any : effects_) {
    std::visit(
        [this](const auto& effect) {
          if constexpr (ActsOnActuator<std::decay_t<decltype(effect)>>) lines_.emplace_back();
        },
        any);
    if (const auto* coulomb = std::get_if<Coulomb>(&any)) coulomb_Nm_ += coulomb->parameters().torque_Nm;
  }
}

double EffectChain::deliver(double command_Nm, double interval_s) noexcept {
  double torque_Nm = command_Nm;
  auto line = lines_.begin();
  for (const AnyEffect& any : effects_) {
    ask(any, [&](const auto& effect) {
      if constexpr (ActsOnActuator<std::decay_t<decltype(effect)>>)
        torque_Nm = effect.deliver(*line++, torque_Nm, interval_s);
    });
  }
  return torque_Nm;
}

double EffectChain::level_Nm(double speed_rad_per_s, double direction, double running_s,
                             double load_Nm) const noexcept {
  return std::max(signed_level_Nm(speed_rad_per_s, direction, running_s, load_Nm), 0.0);
}

double EffectChain::signed_level_Nm(double speed_rad_per_s, double direction, double running_s,
                                    double load_Nm) const noexcept {
  const Sliding sliding{speed_rad_per_s, direction, running_s, coulomb_Nm_, load_Nm};
  double level = 0;
  for (const AnyEffect& any : effects_) {
    ask(any, [&](const auto& effect) {
      if constexpr (ActsOnFriction<std::decay_t<decltype(effect)>>) level += effect.level_Nm(sliding);
    });
  }
  return level;
}

double EffectChain::load_Nm(double position_rad) const noexcept {
  double load = 0;
  for (const AnyEffect& any : effects_) {
    ask(any, [&](const auto& effect) {
      using E = std::decay_t<decltype(effect)>;
      if constexpr (ActsOnPosition<E> && !ActsOnMotor<E>) load += effect.load_Nm(position_rad);
    });
  }
  return load;
}

double EffectChain::motor_load_Nm(double position_rad) const noexcept {
  double load = 0;
  for (const AnyEffect& any : effects_) {
    ask(any, [&](const auto& effect) {
      if constexpr (ActsOnMotor<std::decay_t<decltype(effect)>>) load += effect.load_Nm(position_rad);
    });
  }
  return load;
}

double EffectChain::report_Nm(double torque_Nm) const noexcept {
  for (const AnyEffect& any : effects_) {
    ask(any, [&](const auto& effect) {
      if constexpr (ActsOnSensor<std::decay_t<decltype(effect)>>) torque_Nm = effect.report_Nm(torque_Nm);
    });
  }
  return torque_Nm;
}

Mechanics EffectChain::arranged(Mechanics mechanics) const {
  for (const AnyEffect& any : effects_) {
    std::visit(
        [&](const auto& effect) {
          if constexpr (ActsOnMechanics<std::decay_t<decltype(effect)>>) effect.arrange(mechanics);
        },
        any);
  }
  if (!(mechanics.inertia_kg_m2 > 0))
    throw std::invalid_argument("effect inertia: leaves " + std::to_string(mechanics.inertia_kg_m2) +
                                " kg m² of inertia");
  return mechanics;
}

}  // namespace model::effects
