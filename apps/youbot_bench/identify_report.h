/// @file
#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "apps/youbot_bench/model_writer.h"
#include "identification/fit/model_choice.h"
#include "identification/fit/static_map.h"

namespace youbot_bench {

/// What a report of an identification shows beyond the model itself.
struct IdentificationEvidence {
  identification::fit::StaticMap map{};                        ///< empty without one
  std::vector<identification::fit::MapPoint> not_asked_for{};  ///< taken from the map before the fit
  std::optional<identification::fit::ModelChoice> choice{};    ///< when the terms were chosen from the data
};

struct IdentifiedRig {
  IdentifiedModel model;
  IdentificationEvidence evidence;
};

/// Writes `directory`/report.html, one page for all rigs: their friction curves with what was left out, the
/// residuals, the terms that were tried and every parameter with its interval, or why it has none.
/// @throws hal::SetupError naming path and cause.
void write_identify_report(std::span<const IdentifiedRig> rigs, const std::filesystem::path& directory);

}  // namespace youbot_bench
