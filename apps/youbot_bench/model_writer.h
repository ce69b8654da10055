/// @file
/// Writes a drive model file (format youbot-drive-model/1) from what was identified.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "identification/fit/static_fit.h"
#include "identification/fit/statistics.h"
#include "model/effects/drive_model.h"
#include "runtime/configuration/quantity.h"

namespace youbot_bench {

/// Written where nothing tells it, as a file without an inertia is none: a youBot's wheel with its motor.
inline constexpr double kAssumedInertia_kg_m2 = model::effects::Mechanics{}.inertia_kg_m2;

struct IdentifiedModel {
  std::string name;                       ///< of the rig
  std::optional<double> inertia_kg_m2{};  ///< known or identified; else assumed, which a comment says
  std::vector<std::string> evidence{};    ///< comment lines at the top
  std::optional<identification::fit::StaticFit> sliding{};
  std::vector<identification::fit::Estimate> moving{};  ///< used when there is no map
  std::vector<identification::fit::Estimate> presliding{};
};

/// "coulomb", "stribeck velocity" and the unit: the effect alone where it has but one parameter.
runtime::Quantity quantity_of(const identification::fit::Estimate& estimate);
/// Its value was set by the user: it counts, without an interval.
bool is_given(const identification::fit::Estimate& estimate);

/// The text of the file, which loads. Only what was identified becomes an effect; what was not is named in a
/// comment.
std::string model_text(const IdentifiedModel& model);
/// What is read from that file.
model::effects::DriveModel drive_model_of(const IdentifiedModel& model);

}  // namespace youbot_bench
