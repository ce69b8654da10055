/// @file
/// `youbot-gap`: where a drive model and recordings disagree, what is missing, and a model that has it.
#pragma once
#include <cstdint>
#include <filesystem>

#include "apps/youbot_gap/inputs.h"

namespace youbot_gap {

struct GapOptions {
  InputPaths inputs{};
  std::filesystem::path out{};
  std::uint64_t seed = 1;
  bool quiet = false;
};

/// Writes `out`/model.toml, report.html and gap.json, each whole or not at all, and prints what was found.
/// @throws apps::ConfigError or std::invalid_argument when model, recordings or directory cannot be used, or
///         the data cannot carry the question; std::runtime_error when a file cannot be written.
void explain_gap(const GapOptions& options);

}  // namespace youbot_gap
