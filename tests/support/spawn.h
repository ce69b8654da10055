/// @file
/// Runs a program without a shell, which a preloaded sanitizer library would crash.
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace support {

struct SpawnResult {
  int exit_code = -1;    ///< -1 if it could not be started or was ended by a signal
  std::string output{};  ///< both streams
  bool said(std::string_view part) const { return output.find(part) != std::string::npos; }
};

/// The program and its arguments. Blocks until it ends.
SpawnResult spawn(std::vector<std::string> words);

}  // namespace support
