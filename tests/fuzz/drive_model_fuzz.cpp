// Drive models, as compensators, simulations and youbot-gap read them.
#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>

#include "model/effects/resistance.h"
#include "runtime/configuration/drive_model_file.h"
#include "runtime/configuration/toml_reader.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace {

using fuzz::require;
using model::effects::DriveModel;

constexpr double kTopSpeed_rad_per_s = 12;

/// Negated so that NaN fails.
void within(double value, double least, double most) { require(value >= least && value <= most); }

void check_ranges(const DriveModel& model) {
  within(model.inertia_kg_m2, 1e-12, 1e6);
  if (model.encoder_ticks_per_rev)
    require(std::isfinite(*model.encoder_ticks_per_rev) && *model.encoder_ticks_per_rev >= 1);
  if (model.torque_noise_Nm) require(std::isfinite(*model.torque_noise_Nm) && *model.torque_noise_Nm >= 0);
  for (const model::effects::AnyEffect& effect : model.effects)
    for (const auto& parameter : model::effects::effect_description(name_of(effect)).parameters)
      within(parameter_of(effect, parameter.name), parameter.lower, parameter.upper);
}

/// The controller's additional torque brakes at all speeds that a joint may have.
void check_compensation(const DriveModel& model) {
  if (!runtime::driving_friction(model, kTopSpeed_rad_per_s).empty()) return;
  try {
    const model::JointResistance resistance = model::effects::resistance_of(model);
    for (double speed = 0; speed <= kTopSpeed_rad_per_s; speed += 0.5)
      for (const double direction : {1.0, -1.0}) {
        const double level_Nm = resistance.sliding.level_Nm(std::copysign(speed, direction));
        require(std::isfinite(level_Nm) && level_Nm >= 0);
      }
    require(std::isfinite(resistance.least_torque_Nm) && resistance.least_torque_Nm >= 0);
  } catch (const std::invalid_argument&) {
    // Friction beyond the range of a double.
  }
}

/// Written, it reads back the same to the last digit.
void check_round_trip(const DriveModel& model, const fuzz::MemoryFile& file) {
  const std::string text = runtime::drive_model_text(model);
  file.hold(text);
  require(runtime::drive_model_text(runtime::read_drive_model(file.path())) == text);
}

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  std::vector<Bytes> seeds;
  // One of each effect with the values it begins with.
  DriveModel all{
      .name = "wheel-1", .inertia_kg_m2 = 0.0112, .encoder_ticks_per_rev = 4096, .torque_noise_Nm = 1e-3};
  for (const model::effects::EffectDescription& effect : model::effects::effect_descriptions()) {
    DriveModel one{.name = "wheel-1", .inertia_kg_m2 = 0.0112};
    one.effects.push_back(model::effects::make_effect(effect.name));
    all.effects.push_back(one.effects.front());
    seeds.push_back(bytes_of(runtime::drive_model_text(one)));
  }
  seeds.push_back(bytes_of(runtime::drive_model_text(all)));
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::MemoryFile file;
  file.hold({data, size});
  try {
    const DriveModel model = runtime::read_drive_model(file.path());
    check_ranges(model);
    check_compensation(model);
    check_round_trip(model, file);
  } catch (const runtime::ConfigError& error) {
    require(!error.problems().empty());
    for (const std::string& problem : error.problems()) require(problem.starts_with(file.path() + ":"));
  }
  return 0;
}
