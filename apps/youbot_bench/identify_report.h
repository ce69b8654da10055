/// @file
#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "apps/youbot_bench/model_writer.h"
#include "sim/identify/model_choice.h"
#include "sim/identify/static_map.h"

namespace youbot_bench {

/// What a report of an identification shows beyond the model itself.
struct IdentificationEvidence {
  sim::identify::StaticMap map{};                        ///< empty without one
  std::vector<sim::identify::MapPoint> not_asked_for{};  ///< taken from the map before the fit
  std::optional<sim::identify::ModelChoice> choice{};    ///< when the terms were chosen from the data
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
