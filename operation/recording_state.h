/// @file
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace operation {

/// State of a recording while it is written.
struct RecordingState {
  std::uint64_t cycles_lost = 0;        ///< so far, in at least one file
  std::vector<std::string> problems{};  ///< texts with path and cause; empty if there are none
};

}  // namespace operation
