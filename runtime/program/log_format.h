/// @file
#pragma once
#include <spdlog/formatter.h>

#include <memory>

namespace runtime {

/// Line format of all programs' logs, for spdlog: "youbotd: warning: ...". The text is printable, whatever it
/// quotes.
std::unique_ptr<spdlog::formatter> log_format();

}  // namespace runtime
