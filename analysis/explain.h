/// @file
/// `youbot-gap`: finds where a drive model and recordings disagree, names the missing effect, and adds it to
/// the model.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>

#include "analysis/findings.h"
#include "analysis/inputs.h"

namespace analysis {

struct GapOptions {
  InputPaths inputs{};
  std::filesystem::path out{};
  std::uint64_t seed = 1;
  bool accept_unnamed = false;  ///< a torque without a physical name becomes part of the model
  bool quiet = false;
};

/// Writes `out`/model.toml, report.html and gap.json, and model-unnamed.toml where a torque without a
/// physical name is offered and not accepted, about `inputs`, which were read from the paths in `options`;
/// each file is complete or missing. Prints nothing. Recordings that the caller moves here are not copied.
/// `progress`: see identification::gap::Options.
/// @throws std::invalid_argument if the directory cannot be used, or the data cannot answer the question;
/// std::runtime_error if a file cannot be written.
Findings write_findings(Inputs inputs, const GapOptions& options,
                        const std::function<void(std::string_view what, double done)>& progress);

/// Reads and writes the same with a progress line, and prints the result.
/// @throws likewise, and runtime::ConfigError or std::invalid_argument if model or recordings cannot be used.
void explain_gap(const GapOptions& options);

}  // namespace analysis
