/// @file
/// `youbot-bench identify`: parameters of a drive model from recordings.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/youbot_bench/subcommand.h"
#include "identification/fit/static_map.h"

namespace youbot_bench {

struct IdentifyOptions {
  std::vector<std::filesystem::path> maps{};  ///< steady-state maps, or directories with maps in them
  std::filesystem::path presliding{};         ///< needs a map, and an inertia or a moving recording
  std::filesystem::path moving{};
  std::string joint{};  ///< of MCAP files that others wrote with several joints
  /// "auto" selects the terms; otherwise a friction law, optionally with "+offset", "+asymmetry" or
  /// "+quadratic".
  std::string law = "auto";
  std::optional<double> inertia_kg_m2{};
  identification::fit::SpeedRange speeds{};  ///< of the maps, used for the fit of the law
  std::filesystem::path out{};
  bool quiet = false;
};

/// Prints the result, with intervals, errors and the limits of the recordings, and writes `out`/model.toml
/// and report.html. Maps of several rigs give `out`/RIG/model.toml for each and one report about all. @throws
/// std::invalid_argument or runtime::RecordingError for files that do not fit together, an unknown law, one
/// that would drive the joint or an older model in `out`; hal::SetupError if the files cannot be written.
void identify(const IdentifyOptions& options);

Subcommand add_identify(CLI::App& app);

}  // namespace youbot_bench
