/// @file
/// Where a run is recorded, and the configuration that made it beside it.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace apps {

/// Makes the directory where it is missing and copies the configuration into it as `config.toml`, never over
/// another. False when there is no directory to write to. What went wrong is added to `problems`.
bool make_recording_directory(const std::filesystem::path& directory,
                              const std::filesystem::path& config_file, std::vector<std::string>& problems);

}  // namespace apps
