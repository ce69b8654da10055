/// @file
/// An effect selected at run time: by name, with parameters by name.
#pragma once
#include <span>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "model/catalogue.h"
#include "model/effects/actuator.h"
#include "model/effects/custom.h"
#include "model/effects/effect.h"
#include "model/effects/empirical.h"
#include "model/effects/friction.h"
#include "model/effects/friction_law.h"
#include "model/effects/mechanics.h"
#include "model/effects/position.h"

namespace model::effects {

template <class... Es>
struct EffectList {
  using Library = std::variant<Es...>;
  using Any = std::variant<Es..., FrictionLaw, Custom, Empirical>;
};
using Effects = EffectList<Coulomb, Viscous, Stribeck, DirectionAsymmetry, MidspeedDip, QuadraticDrag,
                           LoadFriction, ThermalDrift, PositionFriction, Presliding, Cogging, Imbalance,
                           Spring, Inertia, Backlash, Elasticity, TorqueOffset, TorqueDeadband,
                           TorqueSaturation, TorqueLag, TransportDelay, UnsignedCurrent, TorqueRipple,
                           EncoderEccentricity, ActuatorGain, ActuatorOffset, TorqueSensorOffset>;
/// An effect of one of the library's types, a friction law, one that the program has added, or one without a
/// name, which is described, but not listed: no name and no numbers make it.
using AnyEffect = Effects::Any;

using model::NamedValue;
using model::ParameterDescription;

struct EffectDescription {
  std::string_view name;
  std::string_view shows;  ///< how it appears in measured data
  std::span<const ParameterDescription> parameters;
};
/// All effects but friction laws: the library's, then those that the program has added. Valid for the
/// lifetime of the program.
std::span<const EffectDescription> effect_descriptions();
/// The friction laws that are effects: all but coulomb and viscous, which the library has.
std::span<const EffectDescription> friction_law_effects();
/// Of an effect or a friction law. @throws std::invalid_argument listing the known effects and laws.
const EffectDescription& effect_description(std::string_view effect);
const EffectDescription& description_of(const AnyEffect& effect) noexcept;

std::string_view name_of(const AnyEffect& effect) noexcept;
/// @throws std::invalid_argument listing the effect's parameters if `parameter` is unknown.
double parameter_of(const AnyEffect& effect, std::string_view parameter);

/// Its parameters, in the order of its description.
std::vector<double> values_of(const AnyEffect& effect);
/// The same effect with these parameters. @throws std::invalid_argument if one is out of bounds.
AnyEffect with_values(const AnyEffect& effect, std::span<const double> values);

/// Other parameters keep their defaults. @throws std::invalid_argument listing the known names if the effect
/// or a parameter is unknown, or naming a parameter that is out of bounds.
AnyEffect make_effect(std::string_view effect, std::span<const NamedValue> values);
AnyEffect make_effect(std::string_view effect, std::initializer_list<NamedValue> values = {});

}  // namespace model::effects
