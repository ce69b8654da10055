/// @file
#pragma once
#include <filesystem>

#include "runtime/mcap/mcap_reader.h"

namespace runtime::mcap {

/// Reads a regular file from its beginning. @throws ConfigError, then and while reading, naming the file.
ReadBytes read_file(const std::filesystem::path& path);

}  // namespace runtime::mcap
