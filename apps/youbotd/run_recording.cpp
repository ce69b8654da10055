#include "apps/youbotd/run_recording.h"

#include <stdexcept>
#include <system_error>

#include "apps/youbotd/check_recording.h"
#include "runtime/recording/output_directory.h"

namespace youbotd {

bool holds_recording(const std::filesystem::path& directory) {
  // A directory that cannot be looked into cannot be written to either, and making files in it says why.
  std::error_code unknown;
  for (const char* name : {"config.toml", "base.csv", "wheel-1.csv", "teleoperation.csv"})
    if (std::filesystem::exists(directory / name, unknown)) return true;
  return false;
}

void check_record_directory(const std::filesystem::path& directory) {
  if (holds_recording(directory))
    throw std::invalid_argument("--record: " + directory.string() +
                                " holds a recording already; name a new directory");
  runtime::try_output_directory(directory);
  require_room(directory);
}

}  // namespace youbotd
