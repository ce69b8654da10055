/// @file
/// `youbot-bench identify`: parameters of a drive model from recordings.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace youbot_bench {

struct IdentifyOptions {
  std::vector<std::filesystem::path> maps{};  ///< steady-state maps of one rig
  std::filesystem::path presliding{};         ///< needs a map, and an inertia or a moving recording
  std::filesystem::path moving{};
  /// "auto" chooses the terms; else a friction law, with "+offset", "+asymmetry" or "+quadratic" as wanted.
  std::string law = "auto";
  std::optional<double> inertia_kg_m2{};
  std::filesystem::path out{};
};

/// Prints what was found, with intervals, errors and what the recordings do not tell, and writes
/// `out`/model.toml and report.html. @throws std::invalid_argument or apps::RecordingError for files that do
/// not fit together or an unknown law; std::runtime_error when the model cannot be written.
void identify(const IdentifyOptions& options);

}  // namespace youbot_bench
