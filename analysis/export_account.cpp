#include "analysis/export_account.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <cstddef>
#include <variant>

#include "model/effects/effect_chain.h"

namespace analysis {
namespace {

using identification::gap::MeasuredGap;
using identification::gap::Signals;
using model::effects::DriveModel;

DriveModel without(DriveModel model, std::size_t effect) {
  model.effects.erase(model.effects.begin() + static_cast<std::ptrdiff_t>(effect));
  return model;
}

/// Errors below this share of the friction are those of the arithmetic.
constexpr double kExact = 1e-6;

}  // namespace

std::string account_line(const Carriage& carriage, const std::optional<Cost>& cost) {
  std::string line = carriage.effect + ": ";
  if (!carriage.as.empty())
    return line + carriage.as + (carriage.lost.empty() ? "" : "; lost: " + carriage.lost);
  line += "not carried";
  if (cost)
    line += fmt::format("; without it the gap on the recordings is {:.4g} N·m instead of {:.4g}",
                        cost->without_Nm, cost->whole_Nm);
  return line;
}

std::string account_end(std::string_view target, const std::optional<Cost>& cost) {
  if (!cost) return "what the losses cost was not measured: no recordings were given";
  return fmt::format("gap on the recordings: {:.4g} N·m with the model, {:.4g} with what {} holds of it",
                     cost->whole_Nm, cost->without_Nm, target);
}

double gap_with_sliding_Nm(const MeasuredGap& data, const DriveModel& carried, const SlidingFit& sliding) {
  DriveModel without_memory = carried;  // of a friction law, the fit has the steady curve
  std::erase_if(without_memory.effects, [](const auto& effect) {
    return std::holds_alternative<model::effects::FrictionLaw>(effect);
  });
  DriveModel slides = without_memory;
  std::erase_if(slides.effects, [](const auto& effect) { return part_of(effect) != Part::kSliding; });
  const model::effects::EffectChain chain(slides.effects);
  return data.gap_Nm(without_memory, [&](const Signals& s) {
    std::vector<double> more(s.size());
    for (std::size_t i = 0; i < s.size(); ++i) {
      const double speed = std::abs(s.velocity_rad_per_s[i]);
      const double ahead = std::copysign(1.0, s.velocity_rad_per_s[i]);
      more[i] =
          s.direction[i] *
              (sliding.level_Nm(speed) -
               chain.level_Nm({.speed_rad_per_s = speed, .direction = ahead, .running_s = s.running_s[i]})) +
          sliding.offset_Nm;
    }
    return more;
  });
}

std::vector<std::string> account_of(const DriveModel& model, const Target& target, const SlidingFit& sliding,
                                    const MeasuredGap* data) {
  std::vector<std::string> lines;
  const double whole_Nm = data != nullptr ? data->gap_Nm(model) : 0;
  const std::vector<Carriage> carriages = carriages_of(model, target);
  for (std::size_t i = 0; i < carriages.size(); ++i) {
    std::optional<Cost> cost;
    if (data != nullptr && carriages[i].as.empty())
      cost = {.without_Nm = data->gap_Nm(without(model, i)), .whole_Nm = whole_Nm};
    lines.push_back(account_line(carriages[i], cost));
  }
  if (model.servo) lines.emplace_back("servo: not carried; the file takes a torque, not a set-point");
  const double level_Nm = sliding.level_Nm(0) + std::abs(sliding.offset_Nm);
  if (sliding.rms_error_Nm > kExact * level_Nm)
    lines.push_back(
        fmt::format("sliding friction: {:.3g} N·m rms off the model's; worst {:.3g} N·m at {:.3g} rad/s",
                    sliding.rms_error_Nm, sliding.worst_error_Nm, sliding.worst_at_rad_per_s));
  std::optional<Cost> cost;
  if (data != nullptr)
    cost = {.without_Nm = gap_with_sliding_Nm(*data, carried_by(model, target), sliding),
            .whole_Nm = whole_Nm};
  lines.push_back(account_end(target.name, cost));
  return lines;
}

}  // namespace analysis
