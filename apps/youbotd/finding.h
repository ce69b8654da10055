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
    kWarn,  ///< youbotd runs, but with limitations
    kFail,  ///< it does not run, or not as configured
  };
  Mark mark = Mark::kOk;
  std::string found{};   ///< "clock source: tsc"
  std::string remedy{};  ///< a command to type if there is one; empty: nothing to do
};
using Findings = std::vector<Finding>;

}  // namespace youbotd
