/// @file
/// Whether a run can be recorded where it is told to.
#pragma once
#include <chrono>
#include <filesystem>

#include "apps/youbotd/finding.h"

namespace youbotd {

/// Writes a file where `directory` is, or where it would be made, and takes it away again. `holds_recording`:
/// an earlier one is there, which is never replaced.
Finding check_recording(const std::filesystem::path& directory, bool holds_recording,
                        std::chrono::nanoseconds period);

/// Of a disk with so many bytes left.
Finding check_room(const std::filesystem::path& directory, double free_bytes,
                   std::chrono::nanoseconds period);

}  // namespace youbotd
