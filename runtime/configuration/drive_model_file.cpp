#include "runtime/configuration/drive_model_file.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>
#include <variant>

#include "model/effects/dissipation.h"
#include "model/effects/mechanics.h"
#include "model/servo_law_keys.h"
#include "runtime/configuration/toml_reader.h"

namespace runtime {
namespace {

using model::effects::AnyEffect;
using model::effects::DriveModel;
using model::effects::EffectDescription;
using model::effects::Empirical;
using model::effects::NamedValue;
using model::effects::ParameterDescription;

constexpr std::string_view kFormat = "youbot-drive-model/1";
/// All of them act in each cycle.
constexpr std::size_t kMaxEffects = 32;

/// Parameters whose defaults are not zero and that a file may leave out, by effect (empty: any). Those of a
/// gap and of a gear's loss are newer than the format: files without them stay valid.
struct WithDefault {
  std::string_view effect;
  std::string_view parameter;
};
constexpr std::array kWithDefault{WithDefault{"", "exponent"},
                                  WithDefault{"backlash", "friction_ratio"},
                                  WithDefault{"backlash", "impact_loss_s_per_rad"},
                                  WithDefault{"backlash", "flank_Hz"},
                                  WithDefault{"load_friction", "backdriving_ratio"},
                                  WithDefault{"position_friction", "periods_per_rev"},
                                  WithDefault{"encoder_eccentricity", "periods_per_rev"}};

bool may_be_absent(std::string_view effect, const ParameterDescription& parameter) {
  return parameter.initial == 0 || std::ranges::any_of(kWithDefault, [&](const WithDefault& one) {
           return one.parameter == parameter.name && (one.effect.empty() || one.effect == effect);
         });
}

constexpr auto kFamilies = {&model::effects::effect_descriptions, &model::effects::friction_law_effects};

std::string names(std::span<const EffectDescription> effects) {
  std::string names;
  for (const EffectDescription& effect : effects) (names += names.empty() ? "" : ", ") += effect.name;
  return names;
}

/// A law's parameters all have defaults.
void read_parameters(TomlTable& table, const EffectDescription& effect, bool is_law,
                     std::vector<AnyEffect>& effects) {
  std::vector<NamedValue> values;
  for (const ParameterDescription& parameter : effect.parameters) {
    double value = parameter.initial;
    table.number(parameter.name, value,
                 {parameter.lower, parameter.upper, !is_law && !may_be_absent(effect.name, parameter)});
    values.push_back({parameter.name, value});
  }
  try {
    effects.push_back(model::effects::make_effect(effect.name, values));
  } catch (const std::invalid_argument& error) {  // values that exclude each other
    table.refuse("type", fmt::format("cannot be made: {}", error.what()));
  }
}

/// One table over one quantity, times a factor.
void read_term(TomlTable& table, std::vector<Empirical::Term>& terms) {
  Empirical::Along along = Empirical::Along::kVelocity;
  Empirical::Times times = Empirical::Times::kOne;
  table.choice("along", along, std::span(Empirical::kAlong), {.required = true});
  table.choice("times", times, std::span(Empirical::kTimes), {.required = true});
  double from = 0;
  double to = 0;
  std::vector<double> values;
  const bool turn = along == Empirical::Along::kTurn;
  if (!turn) {
    table.number("from", from, {.required = true});
    table.number("to", to, {.required = true});
  }
  table.list("values", values, {.required = true, .most = Empirical::kMaxValues});
  if (!Empirical::is_term(along, times)) {
    table.refuse("times", fmt::format("is '{}', which no table over {} takes", Empirical::name_of(times),
                                      Empirical::name_of(along)));
    return;
  }
  try {
    terms.push_back({along, times,
                     turn ? model::EvenTable::of_a_turn(std::move(values))
                          : model::EvenTable::over(from, to, std::move(values))});
  } catch (const std::invalid_argument& problem) {
    table.refuse("values", fmt::format("give no {}", problem.what()));
  }
}

void read_empirical(TomlTable& table, std::vector<AnyEffect>& effects) {
  std::vector<Empirical::Term> terms;
  std::vector<TomlTable> tables = table.tables("term", {.most = Empirical::kMaxTerms});
  if (tables.empty()) table.refuse("term", "is missing: an empirical effect has one [[effect.term]] or more");
  for (TomlTable& term : tables) read_term(term, terms);
  if (!terms.empty()) effects.emplace_back(Empirical(std::move(terms)));
}

void read_effect(TomlTable& table, std::vector<AnyEffect>& effects) {
  std::string type;
  table.text("type", type);
  if (type == Empirical::kName) return read_empirical(table, effects);
  if (type == model::effects::LoadFriction::kName && std::ranges::any_of(effects, [](const AnyEffect& any) {
        return std::holds_alternative<model::effects::LoadFriction>(any);
      }))
    table.refuse("type", fmt::format("is '{}' again: a drive has one gear", type));
  for (const auto& family : kFamilies)
    for (const EffectDescription& effect : family())
      if (effect.name == type)
        return read_parameters(table, effect, family == &model::effects::friction_law_effects, effects);
  const std::string problem = !type.empty()       ? fmt::format("is '{}'", type)
                              : table.has("type") ? "names no effect"
                                                  : "is missing";
  table.refuse("type", fmt::format("{}; there are {}, {} and the friction laws {}", problem,
                                   names(model::effects::effect_descriptions()), Empirical::kName,
                                   names(model::effects::friction_law_effects())));
  table.ignore_rest();
}

std::string unit_remark(Empirical::Times times) {
  const std::string_view unit = Empirical::unit_of(times);
  return unit.empty() ? "share of the load" : std::string(unit);
}

std::string terms_text(const Empirical& empirical) {
  std::string text;
  for (const Empirical::Term& term : empirical.terms()) {
    text += fmt::format("[[effect.term]]\nalong = \"{}\"\ntimes = \"{}\"\n", Empirical::name_of(term.along),
                        Empirical::name_of(term.times));
    if (term.table.repeats())
      text += "# values at even steps of a turn, from 0 on";
    else
      text +=
          fmt::format("from = {}  # beyond from and to the last value holds\nto = {}\n# values at even steps",
                      toml_number(term.table.from()), toml_number(term.table.to()));
    text += fmt::format(", in {}\nvalues = [", unit_remark(term.times));
    for (std::size_t i = 0; i < term.table.values().size(); ++i)
      text += (i == 0 ? "" : ", ") + toml_number(term.table.values()[i]);
    text += "]\n";
  }
  return text;
}

model::ServoLaw read_servo(TomlTable table) {
  model::ServoLaw law;
  table.choice("output", law.output,
               {{"voltage", model::ServoLaw::Output::kVoltage}, {"torque", model::ServoLaw::Output::kTorque}},
               {.required = true});
  const bool voltage = law.output == model::ServoLaw::Output::kVoltage;
  for (const model::ServoKey& key : model::kServoKeys) {
    if (key.of_voltage && !voltage) continue;
    const bool required = key.of_voltage || key.member == &model::ServoLaw::limit;
    table.number(key.name, law.*(key.member), {.min = key.lower, .max = key.upper, .required = required});
  }
  return law;
}

std::string servo_text(const model::ServoLaw& law) {
  const bool voltage = law.output == model::ServoLaw::Output::kVoltage;
  std::string text = fmt::format("\n[servo]\noutput = \"{}\"\n", voltage ? "voltage" : "torque");
  for (const model::ServoKey& key : model::kServoKeys)
    if (voltage || !key.of_voltage)
      text += fmt::format("{} = {}\n", key.name, toml_number(law.*(key.member)));
  return text;
}

/// The simulation would refuse it, too, without file and line. `inertia_kg_m2`: what this and former effects
/// leave.
void require_inertia(TomlTable& table, const AnyEffect& effect, double& inertia_kg_m2) {
  const auto* inertia = std::get_if<model::effects::Inertia>(&effect);
  if (inertia == nullptr) return;
  inertia_kg_m2 += inertia->parameters().difference_kg_m2;
  if (!(inertia_kg_m2 > 0))
    table.refuse("difference_kg_m2",
                 fmt::format("leaves {:g} kg m² of 'inertia_kg_m2', allowed is more than 0", inertia_kg_m2));
}

DriveModel read_model(TomlFile file) {
  TomlTable root = file.root();
  DriveModel model;
  std::string format;
  root.text("format", format, {.required = true});
  if (!format.empty() && format != kFormat)
    root.refuse("format", fmt::format("is '{}'; this program reads '{}'", format, kFormat));
  root.text("name", model.name);
  root.number("inertia_kg_m2", model.inertia_kg_m2, {.min = 1e-12, .max = 1e6, .required = true});
  TomlTable sensor = root.table("sensor");
  const auto optional_number = [&sensor](std::string_view key, std::optional<double>& value, double min) {
    double found = std::nan("");
    sensor.number(key, found, {.min = min});
    if (std::isfinite(found)) value = found;
  };
  optional_number("encoder_ticks_per_rev", model.encoder_ticks_per_rev, 1);
  optional_number("torque_noise_Nm", model.torque_noise_Nm, 0);
  if (root.has("servo")) model.servo = read_servo(root.table("servo"));
  double inertia_kg_m2 = model.inertia_kg_m2;
  for (TomlTable& table : root.tables("effect", {.most = kMaxEffects})) {
    const std::size_t before = model.effects.size();
    read_effect(table, model.effects);
    if (model.effects.size() > before) require_inertia(table, model.effects.back(), inertia_kg_m2);
  }
  file.finish();
  return model;
}

}  // namespace

DriveModel read_drive_model(const std::filesystem::path& path) { return read_model(TomlFile::parse(path)); }

DriveModel read_drive_model(const std::filesystem::path& path, const RegularFile& file) {
  return read_model(TomlFile::parse(path, file));
}

std::string drive_model_text(const DriveModel& model, std::span<const std::string> header,
                             std::span<const EffectRemarks> remarks) {
  std::string text;
  for (const std::string& line : header) text += toml_comment(line) + "\n";
  text += fmt::format("format = \"{}\"\nname = {}\ninertia_kg_m2 = {}\n", kFormat, toml_string(model.name),
                      toml_number(model.inertia_kg_m2));
  if (model.encoder_ticks_per_rev || model.torque_noise_Nm) text += "\n[sensor]\n";
  if (model.encoder_ticks_per_rev)
    text += fmt::format("encoder_ticks_per_rev = {}\n", toml_number(*model.encoder_ticks_per_rev));
  if (model.torque_noise_Nm)
    text += fmt::format("torque_noise_Nm = {}\n", toml_number(*model.torque_noise_Nm));
  if (model.servo) text += servo_text(*model.servo);
  for (std::size_t i = 0; i < model.effects.size(); ++i) {
    const AnyEffect& effect = model.effects[i];
    const EffectDescription& described = model::effects::description_of(effect);
    text += "\n";
    if (i < remarks.size())
      for (const std::string& line : remarks[i].evidence) text += toml_comment(line) + "\n";
    text += fmt::format("[[effect]]\ntype = \"{}\"\n", described.name);
    for (std::size_t k = 0; k < described.parameters.size(); ++k) {
      const std::string_view name = described.parameters[k].name;
      text += fmt::format("{} = {}", name, toml_number(model::effects::parameter_of(effect, name)));
      if (i < remarks.size() && k < remarks[i].parameters.size() && !remarks[i].parameters[k].empty())
        text += "  " + toml_comment(remarks[i].parameters[k]);
      text += "\n";
    }
    if (const auto* const empirical = std::get_if<Empirical>(&effect)) text += terms_text(*empirical);
  }
  return text;
}

std::string driving_friction(const DriveModel& model, double top_speed_rad_per_s) {
  const auto from = model::effects::driving_velocity_rad_per_s(model, top_speed_rad_per_s);
  return from
             ? fmt::format("its friction drives the joint from {:.3g} rad/s on, instead of braking it", *from)
             : "";
}

}  // namespace runtime
