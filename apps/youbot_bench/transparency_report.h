/// @file
/// Result of the two-port measurement of teleoperation, for terminal, browser and other programs.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "apps/youbot_bench/transparency.h"
#include "report/report.h"

namespace youbot_bench {

/// "position-error, 700 N/m"
std::string condition_text(const TransparencyCondition& condition);

/// DIRECTORY/position-error-700.csv, a row for each frequency. `config`: the file's name, for its header.
/// @throws hal::SetupError if it cannot be written.
void write_transparency_csv(const std::filesystem::path& directory, const TransparencyPlan& plan,
                            const TransparencyResult& result, const std::string& config);

/// A column for each condition, several lines, each with a line end.
std::string transparency_text(const TransparencyPlan& plan, const std::vector<TransparencyResult>& results);
report::Page transparency_page(const TransparencyPlan& plan, const std::vector<TransparencyResult>& results);

}  // namespace youbot_bench
