#include "runtime/configuration/hidden_effect.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "model/effects/dissipation.h"
#include "runtime/configuration/drive_model_file.h"
#include "runtime/configuration/quantity.h"
#include "runtime/log.h"
#include "runtime/program/wording.h"

namespace runtime {
namespace {

using model::effects::NamedValue;

constexpr double kPi = 3.14159265358979323846;

/// Range from which a parameter is drawn.
struct Draw {
  std::string_view parameter;
  double from;
  double to;
  enum class Kind : std::uint8_t { kPlain, kEitherSign, kWhole } kind = Kind::kPlain;
};
struct Choice {
  std::string_view effect;
  std::vector<Draw> draws;
};

/// Sizes: the measured wheel curves differ by about 0.02 N·m from each other, between turns and from a
/// straight line, with a breakaway of 0.06 to 0.1 N·m; the sensor noise is 0.0015 N·m.
const std::vector<Choice>& choices() {
  static const std::vector<Choice> kChoices{
      {"stribeck", {{"static_torque_Nm", 0.075, 0.1}, {"velocity_rad_per_s", 0.15, 0.5}}},
      {"direction_asymmetry",
       {{"coulomb_Nm", 0.008, 0.02, Draw::Kind::kEitherSign}, {"viscous_Nm_s_per_rad", 0.001, 0.003}}},
      {"midspeed_dip",
       {{"depth_Nm", 0.012, 0.025}, {"centre_rad_per_s", 1.5, 3}, {"width_rad_per_s", 0.6, 1.2}}},
      {"quadratic_drag", {{"coefficient_Nm_s2_per_rad2", 0.0008, 0.002}}},
      {"cogging",
       {{"amplitude_Nm", 0.012, 0.03},
        {"periods_per_rev", 8, 52, Draw::Kind::kWhole},
        {"phase_rad", -kPi, kPi}}},
      {"imbalance", {{"torque_Nm", 0.015, 0.03}, {"rest_position_rad", -kPi, kPi}}},
      {"torque_offset", {{"torque_Nm", 0.01, 0.025, Draw::Kind::kEitherSign}}},
      {"torque_deadband", {{"threshold_Nm", 0.02, 0.04}}},
      {"thermal_drift", {{"coulomb_change_Nm", -0.025, -0.012}, {"time_constant_s", 10, 30}}},
      {"backlash", {{"gap_rad", 0.01, 0.03}, {"load_share", 0.2, 0.4}}}};
  return kChoices;
}

/// The engine is the same on all platforms; the standard library's distributions are not.
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : random_(seed) {}
  double between(double from, double to) {
    constexpr double kTwoToMinus53 = 1.0 / 9007199254740992.0;
    return from + (to - from) * (static_cast<double>(random_() >> 11) * kTwoToMinus53);
  }
  std::size_t below(std::size_t count) {
    return std::min(count - 1, static_cast<std::size_t>(between(0, static_cast<double>(count))));
  }

 private:
  std::mt19937_64 random_;
};

double drawn(const Draw& draw, Chance& chance) {
  const double value = chance.between(draw.from, draw.to);
  switch (draw.kind) {
    case Draw::Kind::kPlain: break;
    case Draw::Kind::kEitherSign: return chance.between(-1, 1) < 0 ? -value : value;
    case Draw::Kind::kWhole: return std::round(value);
  }
  return value;
}

model::effects::AnyEffect drawn_effect(std::uint64_t seed) {
  Chance chance(seed);
  const Choice& choice = choices()[chance.below(choices().size())];
  std::vector<NamedValue> values;
  for (const Draw& draw : choice.draws) values.push_back({draw.parameter, drawn(draw, chance)});
  return model::effects::make_effect(choice.effect, values);
}

}  // namespace

model::effects::DriveModel known_wheel_model() {
  model::effects::DriveModel model;
  model.inertia_kg_m2 = 0.0106;  // rotor through the gear 9.0e-3, wheel 1.6e-3
  model.effects = {model::effects::make_effect("coulomb", {{"torque_Nm", 0.055}}),
                   model::effects::make_effect("viscous", {{"coefficient_Nm_s_per_rad", 0.015}}),
                   model::effects::make_effect(
                       "presliding", {{"stiffness_Nm_per_rad", 250}, {"damping_Nm_s_per_rad", 0.127}})};
  return model;
}

HiddenEffect::HiddenEffect(std::uint64_t seed) : wheel_model_(known_wheel_model()) {
  wheel_model_.effects.push_back(drawn_effect(seed));
}

std::string HiddenEffect::reveal() const {
  const std::string_view name = model::effects::name_of(effect());
  std::string parameters;
  for (const auto& parameter : model::effects::effect_description(name).parameters) {
    const Quantity quantity = quantity_of(parameter.name);
    parameters += (parameters.empty() ? "" : ", ") + quantity.name + " " +
                  number_text(model::effects::parameter_of(effect(), parameter.name), quantity.unit);
  }
  std::string words(name);
  std::ranges::replace(words, '_', ' ');
  return words + ": " + parameters;
}

std::vector<model::effects::DriveModel> simulated_wheel_models(
    const std::vector<std::string>& model_files, const std::optional<std::uint64_t>& hidden_effect) {
  if (!model_files.empty() && hidden_effect)
    throw std::invalid_argument(
        "--hidden-effect and --model: the simulated wheels follow one or the other, give one of them");
  if (hidden_effect) return {HiddenEffect(*hidden_effect).wheel_model()};
  constexpr std::size_t kWheels = 4;
  if (model_files.size() > 1 && model_files.size() != kWheels)
    throw std::invalid_argument("--model: " + std::to_string(model_files.size()) +
                                " files, expected one for all wheels or one for each of the 4");
  std::vector<model::effects::DriveModel> models;
  for (const std::string& file : model_files) {
    models.push_back(read_drive_model(file));
    const std::string why = driving_friction(models.back(), model::effects::kUsualTopSpeed_rad_per_s);
    if (!why.empty()) spdlog::warn("{}: {}; the simulated drive has no friction there", file, why);
  }
  return models;
}

}  // namespace runtime
