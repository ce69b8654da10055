#include "identification/gap/sensor_offset.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <variant>

namespace identification::gap {
namespace {

using model::effects::AnyEffect;
using model::effects::TorqueOffset;
using model::effects::TorqueSensorOffset;

/// Share of an offset by which another of the same size may differ, beyond the intervals.
constexpr double kSameOffset = 0.1;

double sensor_offset_Nm(const model::effects::DriveModel& model) {
  double sum_Nm = 0;
  for (const AnyEffect& effect : model.effects)
    if (const auto* sensor = std::get_if<TorqueSensorOffset>(&effect))
      sum_Nm += sensor->parameters().torque_Nm;
  return sum_Nm;
}

double motion_Nm(const model::effects::DriveModel& model) {
  const auto* offset = model.find<TorqueOffset>();
  return offset != nullptr ? offset->parameters().torque_Nm : 0;
}

}  // namespace

void remove_sensor_offset(std::vector<Source>& sources, const model::effects::DriveModel& base) {
  const double offset_Nm = sensor_offset_Nm(base);
  if (offset_Nm == 0) return;
  for (Source& source : sources)
    for (Recording::Column& column : source.recording.columns)
      if (column.name == "torque_measured_Nm")
        for (double& value : column.values) value -= offset_Nm;
}

OffsetOf offset_of(const FoundEffect& found, const model::effects::DriveModel& given,
                   const FittedModel& fitted, const Rows& rows, const std::vector<Eigen::Index>& use) {
  const double size_Nm = model::effects::parameter_of(found.effect, "torque_Nm");
  FittedModel with_offset = fitted;
  if (with_offset.model.find<TorqueOffset>() == nullptr) {
    with_offset.model.effects.push_back(model::effects::make_effect("torque_offset", {{"torque_Nm", 0}}));
    with_offset = refined(with_offset, rows, use);
  }
  const std::vector<FreeParameter> free = free_parameters(with_offset, rows);
  const auto is_offset = [&](const FreeParameter& p) {
    return p.kind == FreeParameter::Kind::kEffect &&
           std::holds_alternative<TorqueOffset>(with_offset.model.effects[p.effect]);
  };
  const auto at = std::ranges::find_if(free, is_offset) - free.begin();
  const fit::Estimate offset = estimates(with_offset, rows, use)[static_cast<std::size_t>(at)];
  if (!std::isfinite(offset.lower) || !std::isfinite(offset.upper)) return OffsetOf::kEither;
  const double half = 0.5 * (offset.upper - offset.lower) / std::abs(size_Nm);
  const double share = (offset.value - motion_Nm(given)) / size_Nm;
  const auto may_be = [&](double other) { return std::abs(share - other) < half + kSameOffset; };
  if (may_be(0) == may_be(1)) return OffsetOf::kEither;
  return may_be(1) ? OffsetOf::kSensor : OffsetOf::kActuator;
}

void give_to_sensor(FoundEffect& found, const model::effects::DriveModel& given, Result& result) {
  found.effect =
      model::effects::make_effect("torque_sensor_offset", {{"torque_Nm", found.parameters.front().value}});

  // Given effects keep their places.
  auto& effects = result.model.effects;
  const std::size_t kept = std::min(given.effects.size(), effects.size());
  for (std::size_t i = 0; i < kept; ++i)
    if (std::holds_alternative<TorqueOffset>(given.effects[i]) &&
        std::holds_alternative<TorqueOffset>(effects[i]))
      effects[i] = given.effects[i];
  const auto is_added = [](const AnyEffect& effect) { return std::holds_alternative<TorqueOffset>(effect); };
  effects.erase(std::remove_if(effects.begin() + static_cast<std::ptrdiff_t>(kept), effects.end(), is_added),
                effects.end());
  std::erase_if(result.refitted, [](const auto& refit) { return refit.first == TorqueOffset::kName; });
}

}  // namespace identification::gap
