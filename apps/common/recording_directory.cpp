#include "apps/common/recording_directory.h"

#include <system_error>

#include "apps/common/output_directory.h"

namespace apps {

void make_recording_directory(const std::filesystem::path& directory,
                              const std::filesystem::path& config_file, std::vector<std::string>& problems) {
  make_output_directory(directory);
  std::error_code error;
  std::filesystem::copy_file(config_file, directory / "config.toml", error);
  if (error) problems.push_back((directory / "config.toml").string() + ": " + error.message());
}

}  // namespace apps
