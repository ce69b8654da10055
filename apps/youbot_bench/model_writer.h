/// @file
/// Writes a drive model file (format youbot-drive-model/1) from an identification result.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "identification/fit/static_fit.h"
#include "identification/fit/statistics.h"
#include "model/effects/drive_model.h"
#include "runtime/configuration/quantity.h"

namespace youbot_bench {

/// Used if the inertia is unknown, because a file without one is invalid: a youBot's wheel with its motor.
inline constexpr double kAssumedInertia_kg_m2 = model::effects::Mechanics{}.inertia_kg_m2;

struct IdentifiedModel {
  std::string name;                       ///< of the rig
  std::optional<double> inertia_kg_m2{};  ///< known or identified; otherwise assumed, with a comment
  std::vector<std::string> evidence{};    ///< comment lines at the top
  std::optional<identification::fit::StaticFit> sliding{};
  std::vector<identification::fit::Estimate> moving{};  ///< used if there is no map
  std::vector<identification::fit::Estimate> presliding{};
};

/// "coulomb", "stribeck velocity" and the unit: only the effect if it has a single parameter.
runtime::Quantity quantity_of(const identification::fit::Estimate& estimate);
/// The user set its value: it is used, without an interval.
bool is_given(const identification::fit::Estimate& estimate);

/// The text of the file, which loads. Only identified parameters become effects; the others are named in a
/// comment.
std::string model_text(const IdentifiedModel& model);
/// The model read from that file.
model::effects::DriveModel drive_model_of(const IdentifiedModel& model);

}  // namespace youbot_bench
