#include "identification/gap/torque_scale.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "identification/gap/fitted_model.h"
#include "identification/gap/wording.h"
#include "model/effects/basis.h"

namespace identification::gap {
namespace {

/// Half intervals above this share of the value say little.
constexpr double kNarrow = 0.1;
/// Factors that differ by no more than this are one factor.
constexpr double kSame = 0.02;
constexpr std::size_t kMinAmplitudes = 2;

/// A parameter over its given value, with half its 95 % interval.
struct Ratio {
  double value;
  double half;
  bool is_narrow() const noexcept { return half <= kNarrow * std::abs(value); }
  bool may_be(double factor) const noexcept {
    return std::abs(value - factor) <= half + kSame * std::abs(factor);
  }
};

Ratio ratio_of(const fit::Estimate& estimate, double offset, double given) {
  return {(estimate.value + offset) / given, 0.5 * (estimate.upper - estimate.lower) / std::abs(given)};
}

std::optional<Ratio> inertia_ratio(const model::effects::DriveModel& given, const Result& result) {
  for (const FoundEffect& found : result.effects)
    if (model::effects::name_of(found.effect) == "inertia" && !found.parameters.empty() &&
        found.parameters.front().ok())
      return ratio_of(found.parameters.front(), given.inertia_kg_m2, given.inertia_kg_m2);
  return {};
}

/// Of the given model's own effects. A type that it has more than once is left out.
std::vector<Ratio> amplitude_ratios(const model::effects::DriveModel& given, const Result& result) {
  std::vector<Ratio> ratios;
  for (const auto& [type, estimate] : result.refitted) {
    const auto is_type = [&type = type](const model::effects::AnyEffect& effect) {
      return model::effects::name_of(effect) == type;
    };
    if (!estimate.ok() || std::ranges::count_if(given.effects, is_type) != 1) continue;
    const model::effects::AnyEffect& effect = *std::ranges::find_if(given.effects, is_type);
    const auto amplitudes = model::effects::amplitudes_of(effect);
    if (std::ranges::find(amplitudes, estimate.name) == amplitudes.end()) continue;
    if (const double value = model::effects::parameter_of(effect, estimate.name); value != 0)
      ratios.push_back(ratio_of(estimate, 0, value));
  }
  return ratios;
}

}  // namespace

std::optional<double> torque_scale(const model::effects::DriveModel& given, const Result& result) {
  const std::optional<Ratio> inertia = inertia_ratio(given, result);
  if (!inertia || !inertia->is_narrow() || std::abs(inertia->value - 1) <= kInertiaTolerance) return {};
  const std::vector<Ratio> amplitudes = amplitude_ratios(given, result);
  const auto narrow = static_cast<std::size_t>(std::ranges::count_if(amplitudes, &Ratio::is_narrow));
  const bool same =
      std::ranges::all_of(amplitudes, [&](const Ratio& ratio) { return ratio.may_be(inertia->value); });
  if (narrow < kMinAmplitudes || !same) return {};
  return inertia->value;
}

void weigh_torque_scale(const model::effects::DriveModel& given, Result& result) {
  const std::optional<double> factor = torque_scale(given, result);
  if (!factor) return;
  for (FoundEffect& found : result.effects)
    if (model::effects::name_of(found.effect) == "inertia") {
      found.equivalent.emplace_back(kTorqueScale);
      found.wins.clear();        // none were drawn against it
      found.decided_by.reset();  // a weight decides, and no motion
    }
  const std::string_view size = *factor > 1 ? "large" : "small";
  std::string note = "inertia and friction are all " + short_number(*factor) +
                     " times those of the given model: a torque that is recorded too " + std::string(size) +
                     " by that factor (torque constant, gear ratio, gain of the sensor) looks the same. ";
  if (const auto* actuator = result.model.find<model::effects::ActuatorGain>();
      actuator != nullptr && std::abs(actuator->parameters().gain - *factor) <= kSame * *factor) {
    note += "The measured torque is also " + short_number(actuator->parameters().gain) +
            " times the command. Given model and command agree, so the torque sensor is probably wrong. ";
    for (FoundEffect& found : result.effects)
      if (std::holds_alternative<model::effects::ActuatorGain>(found.effect))
        found.equivalent.emplace_back(kTorqueScale);
  }
  note += "Compare the recorded torque with that of a known weight before you use the new inertia.";
  result.notes.push_back(note);
}

}  // namespace identification::gap
