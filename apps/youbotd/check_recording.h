/// @file
/// Checks whether a run can be recorded in its directory.
#pragma once
#include <chrono>
#include <filesystem>

#include "apps/youbotd/finding.h"

namespace youbotd {

/// Writes a file in `directory`, or where it would be created, and removes it again. `holds_recording`: there
/// is an earlier recording, which is never replaced.
Finding check_recording(const std::filesystem::path& directory, bool holds_recording,
                        std::chrono::nanoseconds period);

/// For a disk with this many free bytes.
Finding check_room(const std::filesystem::path& directory, double free_bytes,
                   std::chrono::nanoseconds period);

}  // namespace youbotd
