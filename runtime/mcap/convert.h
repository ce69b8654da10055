/// @file
/// Recordings from CSV to MCAP and back.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace runtime::mcap {

struct Converted {
  std::uint64_t rows = 0;
  std::uint64_t bytes_in = 0;
  std::uint64_t bytes_out = 0;
  std::vector<std::string> warnings = {};  ///< what was left out of `in`, with file and line
};

/// By the extensions, `.csv` and `.mcap`. Configuration files beside a CSV recording become attachments.
/// Numbers, and comments with a key, of a recording of this software come back as the same text; attachments
/// do not come back. `out` appears when it is complete: until then it is `out`.part.
/// @throws std::invalid_argument for other extensions; ConfigError if `in` is no recording; hal::SetupError
/// if `out` exists or cannot be written.
/// `joint`: of an MCAP file, this one alone; empty: everything.
Converted convert(const std::filesystem::path& in, const std::filesystem::path& out,
                  const std::string& joint = {});

}  // namespace runtime::mcap
