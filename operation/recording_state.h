/// @file
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace operation {

/// How a recording fares while it is written.
struct RecordingState {
  std::uint64_t cycles_lost = 0;        ///< by now, in at least one file
  std::vector<std::string> problems{};  ///< in words, with path and cause; empty when all is well
};

}  // namespace operation
