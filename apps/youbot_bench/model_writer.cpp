#include "apps/youbot_bench/model_writer.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "apps/common/drive_model_file.h"
#include "model/effects/any_effect.h"

namespace youbot_bench {
namespace {

using identification::fit::Estimate;

struct Entry {
  std::string_view parameter;
  std::string_view effect;
  std::string_view key;
  std::string_view remark;
};
/// In the order of the file; entries of one effect together.
constexpr auto kEntries = std::to_array<Entry>({
    {"coulomb_Nm", "coulomb", "torque_Nm", ""},
    {"viscous_Nm_s_per_rad", "viscous", "coefficient_Nm_s_per_rad", ""},
    {"static_Nm", "stribeck", "static_torque_Nm", ""},
    {"stribeck_velocity_rad_per_s", "stribeck", "velocity_rad_per_s", ""},
    {"stribeck_exponent", "stribeck", "exponent", ""},
    {"torque_offset_Nm", "torque_offset", "torque_Nm",
     "or Coulomb friction that differs by direction: the same in sliding"},
    {"viscous_asymmetry_Nm_s_per_rad", "direction_asymmetry", "viscous_Nm_s_per_rad", "half the difference"},
    {"quadratic_Nm_s2_per_rad2", "quadratic_drag", "coefficient_Nm_s2_per_rad2", ""},
    {"stiffness_Nm_per_rad", "presliding", "stiffness_Nm_per_rad", ""},
    {"damping_Nm_s_per_rad", "presliding", "damping_Nm_s_per_rad", ""},
});

/// Seven digits: the last that an identification can mean.
double rounded(double value) {
  std::array<char, 40> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 7).ptr;
  double result = value;
  std::from_chars(text.data(), end, result);
  return result;
}

const Estimate* find(std::span<const Estimate> estimates, std::string_view name) {
  const auto found =
      std::find_if(estimates.begin(), estimates.end(), [&](const Estimate& e) { return e.name == name; });
  return found == estimates.end() ? nullptr : &*found;
}

/// What the text of the file is made of.
struct Contents {
  model::effects::DriveModel model{};
  std::vector<std::string> header{};
  std::vector<apps::EffectRemarks> remarks{};
};

/// Adds an effect when all of its parameters are there, else the reasons to the header. An exponent that was
/// given counts with the others.
void add_effect(std::string_view effect, std::span<const Estimate> estimates, Contents& contents) {
  const auto& described = model::effects::effect_description(effect).parameters;
  std::vector<model::effects::NamedValue> values;
  apps::EffectRemarks remarks;
  remarks.parameters.resize(described.size());
  bool fitted = false;
  bool complete = true;
  for (const Entry& entry : kEntries) {
    if (entry.effect != effect) continue;
    const Estimate* const estimate = find(estimates, entry.parameter);
    if (estimate == nullptr) continue;
    if (!estimate->ok() && !is_given(*estimate)) {
      contents.header.push_back("not identifiable: " + estimate->name + ": " + estimate->not_identifiable);
      complete = false;
      continue;
    }
    std::string remark =
        estimate->ok() ? fmt::format("95 %: {:.7g} to {:.7g}", estimate->lower, estimate->upper) : "given";
    if (!entry.remark.empty()) remark += "; " + std::string(entry.remark);
    const auto at = std::ranges::find(described, entry.key, &model::effects::ParameterDescription::name);
    remarks.parameters[static_cast<std::size_t>(at - described.begin())] = remark;
    values.push_back({entry.key, rounded(estimate->value)});
    fitted |= estimate->ok();
  }
  if (!fitted || !complete) return;
  try {
    contents.model.effects.push_back(model::effects::make_effect(effect, values));
    contents.remarks.push_back(std::move(remarks));
  } catch (const std::invalid_argument& error) {  // a law may allow what no drive has
    contents.header.push_back("left out: " + std::string(error.what()));
  }
}

Contents contents_of(const IdentifiedModel& model) {
  Contents contents;
  contents.header = model.evidence;
  contents.model.name = model.name;
  contents.model.inertia_kg_m2 = rounded(model.inertia_kg_m2.value_or(kAssumedInertia_kg_m2));
  if (!model.inertia_kg_m2)
    contents.header.emplace_back(
        "inertia_kg_m2 is assumed, that of a youBot's wheel and its motor; identify it with --moving or give "
        "--inertia");

  std::vector<Estimate> estimates = model.sliding ? model.sliding->parameters : model.moving;
  for (const Estimate& estimate : model.presliding)
    if (find(estimates, estimate.name) == nullptr) estimates.push_back(estimate);
  std::string_view last;
  for (const Entry& entry : kEntries) {
    if (entry.effect == last) continue;
    last = entry.effect;
    add_effect(entry.effect, estimates, contents);
  }
  return contents;
}

}  // namespace

bool is_given(const Estimate& estimate) { return estimate.not_identifiable.starts_with("given"); }

std::string model_text(const IdentifiedModel& model) {
  const Contents contents = contents_of(model);
  return apps::drive_model_text(contents.model, contents.header, contents.remarks);
}

model::effects::DriveModel drive_model_of(const IdentifiedModel& model) { return contents_of(model).model; }

}  // namespace youbot_bench
