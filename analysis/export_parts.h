/// @file
/// Which effects of a drive model another engine can hold, and as what.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "model/effects/drive_model.h"

namespace analysis {

/// Kinds of effects by the place that an engine has for them.
enum class Part : std::uint8_t {
  kSliding,    ///< friction against speed, in either direction
  kContact,    ///< the bristle that carries friction
  kPosition,   ///< torque over position
  kInertia,    ///< of the joint
  kTwoMasses,  ///< a spring or a gap between motor and load
  kActuator,   ///< between command and torque
  kNone,       ///< no place
};

struct Target {
  std::string_view name;  ///< in messages: "MuJoCo"
  std::vector<Part> parts;
};
Target mujoco_target();
/// Armature, damping and friction: what every engine has, and URDF.
Target plain_target(std::string_view name);

/// One line of an export's account.
struct Carriage {
  std::string effect;  ///< type
  std::string as;      ///< "joint frictionloss"; empty if nothing of it is carried
  std::string lost;    ///< what is not carried; empty if all is
};

/// How the target holds an effect. An effect without a row in the table cannot be carried.
Carriage carriage_of(const model::effects::AnyEffect& effect, const Target& target);
/// The same for all effects, in their order.
std::vector<Carriage> carriages_of(const model::effects::DriveModel& model, const Target& target);
Part part_of(const model::effects::AnyEffect& effect);
/// The model with the effects that the target has a place for.
model::effects::DriveModel carried_by(const model::effects::DriveModel& model, const Target& target);

}  // namespace analysis
