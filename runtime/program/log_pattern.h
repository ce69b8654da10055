/// @file
#pragma once

namespace runtime {

/// Lines of all programs' logs, as spdlog wants it: "youbotd: warning: ...".
inline constexpr const char* kLogPattern = "%n: %^%l%$: %v";

}  // namespace runtime
