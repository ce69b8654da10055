/// @file
#pragma once
#include <filesystem>
#include <optional>

#include "apps/youbot_bench/model_writer.h"
#include "sim/identify/model_choice.h"
#include "sim/identify/static_map.h"

namespace youbot_bench {

/// What a report of an identification shows beyond the model itself.
struct IdentificationEvidence {
  sim::identify::StaticMap map{};                      ///< empty without one
  std::optional<sim::identify::ModelChoice> choice{};  ///< when the terms were chosen from the data
};

/// Writes `directory`/report.html: the friction curve with what was left out, its residuals, the terms that
/// were tried and every parameter with its interval, or why it has none.
/// @throws hal::SetupError naming path and cause.
void write_identify_report(const IdentifiedModel& model, const IdentificationEvidence& evidence,
                           const std::filesystem::path& directory);

}  // namespace youbot_bench
