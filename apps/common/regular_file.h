/// @file
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>

namespace apps {

/// Set-up. The whole text of a regular file of at most `limit_bytes`. Anything else of that name, such as a
/// pipe, a device or a file of the kernel that has no end, is refused and never waited for.
/// @throws std::runtime_error with the reason, without the path.
std::string read_regular_file(const std::filesystem::path& path, std::size_t limit_bytes);

}  // namespace apps
