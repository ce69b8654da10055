/// @file
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace youbotd {

/// One line of `youbotd --check`.
struct Finding {
  enum class Mark : std::uint8_t {
    kOk,
    kWarn,  ///< youbotd runs, but not as well as it could
    kFail,  ///< it does not run, or not as it was told to
  };
  Mark mark = Mark::kOk;
  std::string found{};   ///< "clock source: tsc"
  std::string remedy{};  ///< a command to type where there is one; empty: nothing to do
};
using Findings = std::vector<Finding>;

}  // namespace youbotd
