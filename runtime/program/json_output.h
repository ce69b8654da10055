/// @file
/// `--json`: the output of a command, for other programs.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace runtime {

enum class Format : std::uint8_t { kText, kJson };

inline void add_json_flag(CLI::App& command, Format& format) {
  command.add_flag_callback(
      "--json", [&format] { format = Format::kJson; }, "print JSON, for other programs");
}

/// To standard output. Bytes that are not UTF-8, as in a slave's name, are replaced.
inline void print(const nlohmann::json& json) {
  std::printf("%s\n", json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
}

}  // namespace runtime
