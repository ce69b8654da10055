/// @file
#pragma once
#include <filesystem>
#include <string_view>

namespace runtime {

/// Writes a file atomically: it is complete or missing, whenever the process or the machine stops; an older
/// file of that name is replaced only when the new one is complete. @throws hal::SetupError naming path,
/// cause and what to try.
void write_whole_file(const std::filesystem::path& path, std::string_view text);

}  // namespace runtime
