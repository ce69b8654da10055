/// @file
#pragma once
#include <string>

namespace support {

/// The text of a CSV recording without the time at which it started, for a comparison of two runs.
inline std::string without_start(std::string recording) {
  const std::size_t begin = recording.find("# started: ");
  if (begin != std::string::npos) recording.erase(begin, recording.find('\n', begin) - begin + 1);
  return recording;
}

}  // namespace support
