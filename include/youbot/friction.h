/// @file
/// Friction: laws by name, drive models from files, and compensation that never moves a joint by itself.
///
///     const youbot::JointResistance wheel = youbot::resistance_of(youbot::read_drive_model("model.toml"));
///     youbot::FrictionObserver observer(wheel.sliding, {}, wheel.position);
///     const youbot::FrictionCompensator compensator({.margin = 0.9});
///     each cycle:  torque_Nm += compensator.torque_Nm(torque_Nm, observer.step(position_rad), observer);
///
/// Set-up allocates and throws std::invalid_argument or runtime::ConfigError; a step does neither.
#pragma once
#include "control/friction_compensator.h"
#include "control/friction_observer.h"
#include "model/effects/drive_model.h"
#include "model/effects/resistance.h"
#include "model/friction/any_law.h"
#include "model/friction/law_compensator.h"
#include "model/friction/measured_wheel.h"
#include "runtime/configuration/drive_model_file.h"

namespace youbot {

using control::FrictionCompensator;
using control::FrictionEstimate;
using control::FrictionObserver;
using model::JointResistance;
using model::effects::DriveModel;
using model::effects::make_effect;
using model::effects::name_of;
using model::effects::resistance_of;
using model::friction::AnyLaw;
using model::friction::LawCompensator;
using model::friction::make_law;
using model::friction::wheel_table;
using runtime::drive_model_text;
using runtime::read_drive_model;

}  // namespace youbot
