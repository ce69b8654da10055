#include "analysis/export_parts.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>
#include <variant>

namespace analysis {
namespace {

using model::effects::AnyEffect;
using model::effects::DriveModel;
using model::effects::parameter_of;

using Lost = std::string_view (*)(const AnyEffect&);

std::string_view nothing(const AnyEffect& /*effect*/) { return ""; }
std::string_view of_stribeck(const AnyEffect& stribeck) {
  return parameter_of(stribeck, "exponent") == 2 && parameter_of(stribeck, "tail") == 0
             ? ""
             : "its form: bristles with an exponent of 2 approximate it";
}
std::string_view of_dip(const AnyEffect& /*dip*/) { return "its form: bristles approximate it"; }
std::string_view of_asymmetry(const AnyEffect& asymmetry) {
  return parameter_of(asymmetry, "viscous_Nm_s_per_rad") == 0
             ? ""
             : "the part that changes with speed, but for its mean";
}
std::string_view of_drift(const AnyEffect& /*drift*/) { return "the warming up"; }
std::string_view of_presliding(const AnyEffect& presliding) {
  return parameter_of(presliding, "exponent") == 1 ? "" : "its exponent: a bristle of LuGre has 1";
}
std::string_view of_backlash(const AnyEffect& /*backlash*/) {
  return "losses that grow with the speed of an impact: they are those of a slow one";
}
std::string_view of_saturation(const AnyEffect& /*saturation*/) {
  return "its place behind a lag: it limits the command";
}

struct Row {
  std::string_view effect;
  Part part;
  std::string_view mujoco;  ///< its place there
  std::string_view plain;   ///< its place among armature, damping and friction
  Lost lost_in_mujoco;
};
/// An effect without a row is not carried.
constexpr std::array kRows{
    Row{"coulomb", Part::kSliding, "joint frictionloss, or lugre with a bristle", "friction", nothing},
    Row{"viscous", Part::kSliding, "joint damping", "damping", nothing},
    Row{"quadratic_drag", Part::kSliding, "joint damping, second coefficient", "damping", nothing},
    Row{"stribeck", Part::kSliding, "dcmotor lugre", "friction and damping", of_stribeck},
    Row{"midspeed_dip", Part::kSliding, "dcmotor lugre", "friction and damping", of_dip},
    Row{"direction_asymmetry", Part::kSliding, "general, a constant torque", "", of_asymmetry},
    Row{"thermal_drift", Part::kSliding, "friction of the warm drive", "friction of the warm drive",
        of_drift},
    Row{"presliding", Part::kContact, "dcmotor lugre", "", of_presliding},
    Row{"cogging", Part::kPosition, "dcmotor cogging", "", nothing},
    Row{"imbalance", Part::kPosition, "dcmotor cogging, once per turn", "", nothing},
    Row{"torque_offset", Part::kPosition, "general, a constant torque", "", nothing},
    Row{"inertia", Part::kInertia, "joint armature", "armature", nothing},
    Row{"backlash", Part::kTwoMasses, "two hinges and a tendon with limits", "", of_backlash},
    Row{"elasticity", Part::kTwoMasses, "two hinges and a tendon with stiffness", "", nothing},
    Row{"spring", Part::kPosition, "joint stiffness and springref", "", nothing},
    Row{"transport_delay", Part::kActuator, "actuator delay", "", nothing},
    Row{"torque_lag", Part::kActuator, "actuator dyntype filterexact", "", nothing},
    Row{"torque_saturation", Part::kActuator, "actuator ctrlrange", "", of_saturation},
    Row{"actuator_gain", Part::kActuator, "actuator gear", "", nothing},
    Row{"actuator_offset", Part::kActuator, "general, a constant torque", "", nothing},
};

/// Of a law with memory, the steady curve.
constexpr Row kLaw{"", Part::kSliding, "dcmotor lugre: its steady curve, by bristles", "friction and damping",
                   [](const AnyEffect& /*law*/) -> std::string_view {
                     return "its form, and what a law with memory does at rest and at reversals";
                   }};

const Row* row_of(const AnyEffect& effect) {
  if (std::holds_alternative<model::effects::FrictionLaw>(effect)) return &kLaw;
  const auto* const row = std::ranges::find(kRows, model::effects::name_of(effect), &Row::effect);
  return row == kRows.end() ? nullptr : row;
}

}  // namespace

Target mujoco_target() {
  return {
      "MuJoCo",
      {Part::kSliding, Part::kContact, Part::kPosition, Part::kInertia, Part::kTwoMasses, Part::kActuator}};
}

Target plain_target(std::string_view name) { return {name, {Part::kSliding, Part::kInertia}}; }

Part part_of(const AnyEffect& effect) {
  const Row* const row = row_of(effect);
  return row == nullptr ? Part::kNone : row->part;
}

Carriage carriage_of(const AnyEffect& effect, const Target& target) {
  const Row* const row = row_of(effect);
  Carriage carriage{.effect = std::string(model::effects::name_of(effect)), .as = {}, .lost = "all of it"};
  if (row == nullptr || std::ranges::find(target.parts, row->part) == target.parts.end()) return carriage;
  const bool plain = std::ranges::find(target.parts, Part::kContact) == target.parts.end();
  carriage.as = plain ? row->plain : row->mujoco;
  if (carriage.as.empty()) return carriage;
  carriage.lost = row->lost_in_mujoco(effect);
  if (plain && row->effect != "coulomb" && row->effect != "viscous" && row->effect != "inertia")
    carriage.lost = "all but the nearest straight line over speed";
  return carriage;
}

std::vector<Carriage> carriages_of(const DriveModel& model, const Target& target) {
  std::vector<Carriage> all;
  std::ranges::transform(model.effects, std::back_inserter(all),
                         [&](const AnyEffect& effect) { return carriage_of(effect, target); });
  return all;
}

DriveModel carried_by(const DriveModel& model, const Target& target) {
  DriveModel carried = model;
  std::erase_if(carried.effects,
                [&](const AnyEffect& effect) { return carriage_of(effect, target).as.empty(); });
  return carried;
}

}  // namespace analysis
