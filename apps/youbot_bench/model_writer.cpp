#include "apps/youbot_bench/model_writer.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "model/effects/any_effect.h"
#include "runtime/configuration/drive_model_file.h"
#include "runtime/program/wording.h"

namespace youbot_bench {
namespace {

using identification::fit::Estimate;

/// Comment on a parameter for readers of the file.
std::string_view remark_on(const Estimate& estimate) {
  if (estimate.effect == "torque_offset")
    return "; or Coulomb friction that differs by direction: the same in sliding";
  if (estimate.effect == "direction_asymmetry") return "; half the difference";
  return "";
}

/// Seven digits: more than an identification resolves.
double rounded(double value) {
  std::array<char, 40> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 7).ptr;
  double result = value;
  std::from_chars(text.data(), end, result);
  return result;
}

/// What the text of the file is made of.
struct Contents {
  model::effects::DriveModel model{};
  std::vector<std::string> header{};
  std::vector<runtime::EffectRemarks> remarks{};
};

/// Adds an effect if all of its parameters are known; otherwise adds the reasons to the header. A given
/// exponent counts as known.
void add_effect(std::span<const Estimate> estimates, Contents& contents) {
  const std::string& effect = estimates.front().effect;
  const auto& described = model::effects::effect_description(effect).parameters;
  std::vector<model::effects::NamedValue> values;
  runtime::EffectRemarks remarks;
  remarks.parameters.resize(described.size());
  bool fitted = false;
  bool complete = true;
  for (const Estimate& estimate : estimates) {
    if (!estimate.ok() && !is_given(estimate)) {
      contents.header.push_back("not identifiable: " + estimate.title() + ": " + estimate.not_identifiable);
      complete = false;
      continue;
    }
    const auto at = std::ranges::find(described, estimate.name, &model::effects::ParameterDescription::name);
    const runtime::IntervalText interval =
        runtime::interval_text(estimate.value, estimate.lower, estimate.upper, 7, 7);
    remarks.parameters[static_cast<std::size_t>(at - described.begin())] =
        estimate.ok() ? "95 %: " + interval.lower + " to " + interval.upper + std::string(remark_on(estimate))
                      : estimate.not_identifiable.substr(0, estimate.not_identifiable.find(','));
    values.push_back({at->name, rounded(estimate.value)});
    fitted |= estimate.ok();
  }
  if (!fitted || !complete) return;
  try {
    contents.model.effects.push_back(model::effects::make_effect(effect, values));
    contents.remarks.push_back(std::move(remarks));
  } catch (const std::invalid_argument& error) {  // a contact may be identified stiffer than any drive's
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
  if (!model.presliding.empty())  // a map does not show it
    std::erase_if(estimates, [](const Estimate& estimate) { return estimate.effect == "presliding"; });
  for (const Estimate& estimate : model.presliding)
    if (identification::fit::find_estimate(estimates, estimate.effect, estimate.name) == nullptr)
      estimates.push_back(estimate);
  std::erase_if(estimates, [](const Estimate& estimate) { return estimate.effect.empty(); });
  for (std::span<const Estimate> rest = estimates; !rest.empty();) {
    const auto next = std::ranges::find_if(
        rest, [&](const Estimate& estimate) { return estimate.effect != rest.front().effect; });
    const auto count = static_cast<std::size_t>(next - rest.begin());
    add_effect(rest.first(count), contents);
    rest = rest.subspan(count);
  }
  return contents;
}

}  // namespace

runtime::Quantity quantity_of(const Estimate& estimate) {
  runtime::Quantity quantity = runtime::quantity_of(estimate.title());
  if (!estimate.effect.empty() && model::effects::effect_description(estimate.effect).parameters.size() == 1)
    quantity.name = runtime::quantity_of(estimate.effect).name;
  return quantity;
}

bool is_given(const Estimate& estimate) { return estimate.not_identifiable.starts_with("given"); }

std::string model_text(const IdentifiedModel& model) {
  const Contents contents = contents_of(model);
  return runtime::drive_model_text(contents.model, contents.header, contents.remarks);
}

model::effects::DriveModel drive_model_of(const IdentifiedModel& model) { return contents_of(model).model; }

}  // namespace youbot_bench
