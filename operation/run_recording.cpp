#include "operation/run_recording.h"

#include <spdlog/fmt/fmt.h>

#include <stdexcept>
#include <system_error>

#include "hal/setup_error.h"
#include "runtime/recording/output_directory.h"

namespace operation {
namespace {

/// @throws hal::SetupError if the disk has no room for half a minute.
void require_room(const std::filesystem::path& directory, runtime::RecordingFormat format) {
  const double needed_bytes = min_room_bytes(format);
  std::error_code unknown;
  const std::filesystem::space_info space =
      std::filesystem::space(runtime::existing_ancestor(directory), unknown);
  if (unknown || static_cast<double>(space.available) >= needed_bytes) return;
  throw hal::SetupError(
      directory.string(),
      fmt::format("cannot be recorded to: its disk has {:.1f} MB left, and half a minute takes {:.0f}",
                  1e-6 * static_cast<double>(space.available), 1e-6 * needed_bytes),
      "make room, or name another directory");
}

}  // namespace

bool holds_recording(const std::filesystem::path& directory) {
  // A directory that cannot be read cannot be written either; creating files in it reports why.
  std::error_code unknown;
  for (const char* name :
       {"config.toml", "base.mcap", "base.csv", "wheel-1.csv", "teleoperation.mcap", "teleoperation.csv"})
    if (std::filesystem::exists(directory / name, unknown)) return true;
  return false;
}

void check_record_directory(const std::filesystem::path& directory, runtime::RecordingFormat format) {
  if (holds_recording(directory))
    throw std::invalid_argument("--record: " + directory.string() +
                                " holds a recording already; name a new directory");
  runtime::try_output_directory(directory);
  require_room(directory, format);
}

}  // namespace operation
