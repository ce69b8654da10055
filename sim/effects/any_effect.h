/// @file
/// An effect chosen at run time: by name, with parameters by name.
#pragma once
#include <span>
#include <string_view>
#include <utility>
#include <variant>

#include "control/friction/any_law.h"
#include "sim/effects/backlash.h"
#include "sim/effects/cogging.h"
#include "sim/effects/coulomb.h"
#include "sim/effects/direction_asymmetry.h"
#include "sim/effects/effect.h"
#include "sim/effects/elasticity.h"
#include "sim/effects/imbalance.h"
#include "sim/effects/inertia.h"
#include "sim/effects/load_friction.h"
#include "sim/effects/midspeed_dip.h"
#include "sim/effects/presliding.h"
#include "sim/effects/quadratic_drag.h"
#include "sim/effects/stribeck.h"
#include "sim/effects/thermal_drift.h"
#include "sim/effects/torque_deadband.h"
#include "sim/effects/torque_offset.h"
#include "sim/effects/transport_delay.h"
#include "sim/effects/unsigned_current.h"
#include "sim/effects/viscous.h"

namespace sim::effects {

using AnyEffect = std::variant<Coulomb, Viscous, Stribeck, DirectionAsymmetry, MidspeedDip, QuadraticDrag,
                               LoadFriction, ThermalDrift, Presliding, Cogging, Imbalance, Inertia, Backlash,
                               Elasticity, TorqueOffset, TorqueDeadband, TransportDelay, UnsignedCurrent>;

using control::friction::NamedValue;
using control::friction::ParameterDescription;

struct EffectDescription {
  std::string_view name;
  std::string_view shows;  ///< how it shows in measured data
  std::span<const ParameterDescription> parameters;
};
/// All effects, in the order of AnyEffect. Lives as long as the program.
std::span<const EffectDescription> effect_descriptions();
/// @throws std::invalid_argument listing the effects there are.
const EffectDescription& effect_description(std::string_view effect);

std::string_view name_of(const AnyEffect& effect) noexcept;
/// @throws std::invalid_argument listing the effect's parameters when `parameter` is none of them.
double parameter_of(const AnyEffect& effect, std::string_view parameter);

/// What is not named keeps its default. @throws std::invalid_argument listing what exists when the effect or
/// a parameter is unknown, or naming a parameter that is out of bounds.
AnyEffect make_effect(std::string_view effect, std::span<const NamedValue> values);
AnyEffect make_effect(std::string_view effect, std::initializer_list<NamedValue> values = {});

}  // namespace sim::effects
