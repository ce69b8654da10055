/// @file
#pragma once

namespace runtime {

/// Line format of all programs' logs, for spdlog: "youbotd: warning: ...".
inline constexpr const char* kLogPattern = "%n: %^%l%$: %v";

}  // namespace runtime
