/// @file
/// The first comments of a delivered model: where it comes from and what it is worth.
#pragma once
#include <spdlog/fmt/fmt.h>

#include <string>
#include <vector>

#include "identification/gap/gap.h"
#include "runtime/program/build_info.h"
#include "runtime/program/wording.h"

namespace analysis {

/// The gap before and after with its noise floor, as models and terminals show it.
inline std::string gap_line(double before, double after, double noise_floor, const std::string& unit) {
  return fmt::format("{0:.4g} -> {1:.4g} {3}, noise floor {2:.4g} {3}", before, after, noise_floor, unit);
}

/// Of the findings of a drive or of a robot. `gap`: "0.1 -> 0.05 N·m, noise floor 0.04 N·m".
template <typename Findings>
std::vector<std::string> model_header(const Findings& findings, const std::string& gap) {
  const auto& result = findings.result;
  return {
      "written by youbot-gap " + std::string(runtime::build_version()),
      fmt::format("base: {}; seed {}", findings.base_path, findings.seed),
      "searched: " + runtime::list_text(findings.data), "held out: " + runtime::list_text(result.held_out),
      fmt::format("verdict: {}; held-out gap {}", identification::gap::verdict_name(result.verdict), gap)};
}

}  // namespace analysis
