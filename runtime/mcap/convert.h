/// @file
/// Recordings from CSV to MCAP and back.
#pragma once
#include <cstdint>
#include <filesystem>

namespace runtime::mcap {

struct Converted {
  std::uint64_t rows = 0;
  std::uint64_t bytes_in = 0;
  std::uint64_t bytes_out = 0;
};

/// By the extensions, `.csv` and `.mcap`. Configuration files beside a CSV recording become attachments.
/// Numbers and comments of a recording that is converted and back are the same text as before.
/// @throws std::invalid_argument for other extensions; ConfigError if `in` is no recording; hal::SetupError
/// if `out` exists or cannot be written.
Converted convert(const std::filesystem::path& in, const std::filesystem::path& out);

}  // namespace runtime::mcap
