/// @file
#pragma once
#include <filesystem>
#include <string_view>

namespace runtime {

/// Writes a file that is there whole or not at all, whenever the process or the machine stops; an older one
/// of that name is replaced only then. @throws hal::SetupError naming path, cause and what to try.
void write_whole_file(const std::filesystem::path& path, std::string_view text);

}  // namespace runtime
