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

/// Of the findings of a drive or of an arm.
template <typename Findings>
std::vector<std::string> model_header(const Findings& findings) {
  const auto& result = findings.result;
  return {"written by youbot-gap " + std::string(runtime::build_version()),
          fmt::format("base: {}; seed {}", findings.base_path, findings.seed),
          "searched: " + runtime::list_text(findings.data),
          "held out: " + runtime::list_text(result.held_out),
          fmt::format("verdict: {}; held-out gap {:.4g} -> {:.4g} N·m, noise floor {:.4g} N·m",
                      identification::gap::verdict_name(result.verdict), result.gap_before_Nm,
                      result.gap_after_Nm, result.noise_floor_Nm)};
}

}  // namespace analysis
