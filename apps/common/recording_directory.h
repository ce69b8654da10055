/// @file
/// Where a run is recorded, and the configuration that made it beside it.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace apps {

/// Makes the directory where it is missing and copies the configuration into it as `config.toml`, never over
/// another; one that could not be copied is added to `problems`.
/// @throws hal::SetupError when files cannot be made in the directory.
void make_recording_directory(const std::filesystem::path& directory,
                              const std::filesystem::path& config_file, std::vector<std::string>& problems);

}  // namespace apps
