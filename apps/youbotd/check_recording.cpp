#include "apps/youbotd/check_parts.h"

#include <spdlog/fmt/fmt.h>

#include <string>
#include <system_error>

#include "operation/run_recording.h"
#include "runtime/recording/output_directory.h"

namespace youbotd {
namespace {

namespace fs = std::filesystem;
using Mark = Finding::Mark;

constexpr double kEnough_h = 1;

}  // namespace

Finding check_room(const fs::path& directory, double free_bytes, std::chrono::nanoseconds period,
                   runtime::RecordingFormat format) {
  const double bytes_per_h =
      operation::bytes_per_cycle(format) * (std::chrono::duration<double>(std::chrono::hours(1)) / period);
  const double hours = free_bytes / bytes_per_h;
  const std::string found = fmt::format("recording: {} can be written, room for {:.1f} h at {:.1f} GB/h",
                                        directory.string(), hours, bytes_per_h * 1e-9);
  const std::string hint =
      "df -h " + runtime::existing_ancestor(directory).string() + "; name another directory, or make room";
  if (free_bytes < operation::min_room_bytes(format))
    return {Mark::kFail, found + "; a run would be refused", hint};
  if (hours >= kEnough_h) return {Mark::kOk, found};
  return {Mark::kWarn, found + "; a full disk ends the recording, not the run", hint};
}

Finding check_recording(const fs::path& directory, bool holds_recording, std::chrono::nanoseconds period,
                        runtime::RecordingFormat format) {
  if (holds_recording)
    return {Mark::kFail, "recording: " + directory.string() + " holds one already",
            "name a new directory as --record"};
  std::error_code unknown;
  const fs::path parent = runtime::existing_ancestor(directory);
  if (!fs::is_directory(parent, unknown))
    return {Mark::kFail, "recording: " + parent.string() + " is not a directory", "name another directory"};
  if (const std::string why = runtime::why_not_writable(parent); !why.empty())
    return {Mark::kFail, "recording: " + parent.string() + " cannot be written: " + why,
            "sudo install -d -o \"$USER\" " + directory.string() + ", or name another directory"};
  const fs::space_info space = fs::space(parent, unknown);
  if (unknown)
    return {Mark::kWarn, "recording: " + parent.string() + ": " + unknown.message(),
            "df -h " + parent.string()};
  return check_room(directory, static_cast<double>(space.available), period, format);
}

}  // namespace youbotd
