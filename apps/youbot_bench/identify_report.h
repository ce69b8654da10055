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

/// Content of an identification report in addition to the model.
struct IdentificationEvidence {
  identification::fit::StaticMap map{};                        ///< empty without one
  std::vector<identification::fit::MapPoint> not_asked_for{};  ///< removed from the map before the fit
  std::optional<identification::fit::ModelChoice> choice{};    ///< if the terms were selected from the data
};

struct IdentifiedRig {
  IdentifiedModel model;
  IdentificationEvidence evidence;
};

/// Writes `directory`/report.html, one page for all rigs: their friction curves with the excluded points, the
/// residuals, the tried terms and every parameter with its interval, or why it has none.
/// @throws hal::SetupError naming path and cause.
void write_identify_report(std::span<const IdentifiedRig> rigs, const std::filesystem::path& directory);

}  // namespace youbot_bench
