#include "apps/common/recording_directory.h"

#include <system_error>

namespace apps {

bool make_recording_directory(const std::filesystem::path& directory,
                              const std::filesystem::path& config_file, std::vector<std::string>& problems) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) {
    problems.push_back(directory.string() + ": cannot make this directory: " + error.message());
    return false;
  }
  std::filesystem::copy_file(config_file, directory / "config.toml", error);
  if (error) problems.push_back((directory / "config.toml").string() + ": " + error.message());
  return true;
}

}  // namespace apps
