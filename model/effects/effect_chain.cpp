#include "model/effects/effect_chain.h"

#include <algorithm>
#include <cmath>
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

constexpr auto kEachEffect = [](const auto& /*effect*/) { return true; };
constexpr auto kWithoutMemory = [](const auto& effect) {
  if constexpr (std::is_same_v<std::decay_t<decltype(effect)>, FrictionLaw>)
    return !effect.has_memory();
  else
    return true;
};

}  // namespace

EffectChain::EffectChain(std::span<const AnyEffect> effects) : effects_(effects.begin(), effects.end()) {
  for (const AnyEffect& any : effects_) {
    std::visit(
        [this](const auto& effect) {
          using E = std::decay_t<decltype(effect)>;
          if constexpr (ActsOnActuator<E>) memories_.emplace_back();
          if constexpr (ActsOnEncoder<E>) acts_on_encoder_ = true;
        },
        any);
    if (const auto* coulomb = std::get_if<Coulomb>(&any)) coulomb_Nm_ += coulomb->parameters().torque_Nm;
    if (const auto* gear = std::get_if<LoadFriction>(&any)) gears_.push_back(*gear);
    if (const auto* law = std::get_if<FrictionLaw>(&any); law != nullptr && law->has_memory())
      laws_.push_back(*law);
  }
}

double EffectChain::deliver(double command_Nm, double interval_s) noexcept {
  double torque_Nm = command_Nm;
  auto memory = memories_.begin();
  for (const AnyEffect& any : effects_) {
    ask(any, [&](const auto& effect) {
      if constexpr (ActsOnActuator<std::decay_t<decltype(effect)>>)
        torque_Nm = effect.deliver(*memory++, torque_Nm, interval_s);
    });
  }
  return torque_Nm;
}

template <class Use>
double EffectChain::sliding_Nm(const Slide& slide, const Use& use) const noexcept {
  const Sliding sliding{.speed_rad_per_s = slide.speed_rad_per_s,
                        .direction = slide.direction,
                        .running_s = slide.running_s,
                        .coulomb_Nm = coulomb_Nm_,
                        .load_Nm = std::abs(slide.load_Nm),
                        .position_rad = slide.position_rad,
                        .since_reversal_s = slide.since_reversal_s};
  double level = 0;
  for (const AnyEffect& any : effects_) {
    ask(any, [&](const auto& effect) {
      if constexpr (ActsOnFriction<std::decay_t<decltype(effect)>>)
        if (use(effect)) level += effect.level_Nm(sliding);
    });
  }
  return level;
}

double EffectChain::gear_loss_Nm(const Slide& slide, double sliding_Nm) const noexcept {
  const double own_Nm = slide.direction * slide.inertial_Nm + sliding_Nm;
  double loss_Nm = 0;
  for (const LoadFriction& gear : gears_)
    loss_Nm += gear.loss_Nm(gear.transmitted_Nm(slide.direction * slide.load_Nm, own_Nm));
  return loss_Nm;
}

double EffectChain::level_Nm(const Slide& slide) const noexcept {
  return std::max(signed_level_Nm(slide), 0.0);
}

double EffectChain::signed_level_Nm(const Slide& slide) const noexcept {
  const double sliding = sliding_Nm(slide, kEachEffect);
  return sliding + gear_loss_Nm(slide, std::max(sliding, 0.0));
}

double EffectChain::contact_level_Nm(const Slide& slide) const noexcept {
  const double sliding = sliding_Nm(slide, kWithoutMemory);
  return sliding + gear_loss_Nm(slide, std::max(sliding, 0.0));
}

double EffectChain::contact_level_under_Nm(const Slide& slide, double motor_Nm) const noexcept {
  const double sliding = sliding_Nm(slide, kWithoutMemory);
  double loss_Nm = 0;
  for (const LoadFriction& gear : gears_)
    loss_Nm +=
        gear.loss_Nm(gear.transmitted_under_Nm(slide.direction * slide.load_Nm, slide.direction * motor_Nm));
  return sliding + loss_Nm;
}

double EffectChain::laws_Nm(std::span<friction::State> states, const friction::Contact& contact,
                            double step_s) const noexcept {
  double torque_Nm = 0;
  for (std::size_t i = 0; i < laws_.size(); ++i) torque_Nm += laws_[i].law().step(states[i], contact, step_s);
  return torque_Nm;
}

double EffectChain::reduced_laws_Nm(double laws_Nm, double speed_rad_per_s,
                                    double contact_level_Nm) const noexcept {
  if (!(contact_level_Nm < 0)) return laws_Nm;
  const double direction = std::copysign(1.0, laws_Nm);
  const double steady = direction * steady_laws_Nm(std::copysign(speed_rad_per_s, direction));
  return laws_Nm * std::max(1 + contact_level_Nm / steady, 0.0);
}

double EffectChain::steady_laws_Nm(double velocity_rad_per_s) const noexcept {
  double torque_Nm = 0;
  for (const FrictionLaw& each : laws_) torque_Nm += each.law().steady_Nm(velocity_rad_per_s);
  return torque_Nm;
}

double EffectChain::longest_step_s(double inertia_kg_m2, double friction_share) const noexcept {
  double per_s = 0;  // springs in parallel: at most the sum
  for (const AnyEffect& any : effects_)
    if (const auto* law = std::get_if<FrictionLaw>(&any))
      per_s += 1 / law->law().max_step_s(inertia_kg_m2 / friction_share);
  return 1 / per_s;
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

double EffectChain::motor_gain(double position_rad) const noexcept {
  double gain = 1;
  for (const AnyEffect& any : effects_) {
    ask(any, [&](const auto& effect) {
      if constexpr (ActsOnMotorTorque<std::decay_t<decltype(effect)>>) gain *= effect.gain(position_rad);
    });
  }
  return gain;
}

EncoderError EffectChain::encoder_error(double position_rad) const noexcept {
  EncoderError sum;
  for (const AnyEffect& any : effects_) {
    ask(any, [&](const auto& effect) {
      if constexpr (ActsOnEncoder<std::decay_t<decltype(effect)>>) {
        const EncoderError error = effect.error(position_rad);
        sum.value_rad += error.value_rad;
        sum.slope += error.slope;
        sum.bend_per_rad += error.bend_per_rad;
      }
    });
  }
  return sum;
}

EffectChain::Motion EffectChain::motion_behind(const Motion& measured) const noexcept {
  if (!acts_on_encoder_) return measured;
  // Newton's iteration: an error has a small slope, or the encoder would run backwards.
  constexpr int kSteps = 4;
  constexpr double kMinSlope = 0.1;
  Motion motion{.position_rad = measured.position_rad};
  double slope = 1;
  EncoderError error;
  for (int i = 0; i <= kSteps; ++i) {
    error = encoder_error(motion.position_rad);
    slope = std::max(1 + error.slope, kMinSlope);
    if (i < kSteps)
      motion.position_rad -= (motion.position_rad + error.value_rad - measured.position_rad) / slope;
  }
  motion.velocity_rad_per_s = measured.velocity_rad_per_s / slope;
  motion.acceleration_rad_per_s2 =
      (measured.acceleration_rad_per_s2 -
       error.bend_per_rad * motion.velocity_rad_per_s * motion.velocity_rad_per_s) /
      slope;
  return motion;
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
