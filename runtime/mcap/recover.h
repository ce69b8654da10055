/// @file
/// Repairs torn MCAP files of any writer, such as of a program that was killed.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/mcap/mcap_reader.h"

namespace runtime::mcap {

struct Recovered {
  static constexpr std::size_t kMaxListedProblems = 20;

  std::uint64_t messages = 0;
  double duration_s = 0;              ///< from the first message to the last one
  std::vector<std::string> problems;  ///< each with its byte offset, the first kMaxListedProblems
  std::uint64_t damaged_records = 0;  ///< between others; a wrong checksum of the data section counts as one
  std::optional<std::uint64_t> torn_at;  ///< where the record begins in which the file ends
  bool complete() const { return problems.empty(); }
  void list(const McapError& problem) {
    if (problems.size() < kMaxListedProblems) problems.emplace_back(problem.what());
  }
};

/// Writes what can be read of `in` into the complete file `out`.
/// @throws ConfigError if `in` is no MCAP file; hal::SetupError if `out` exists or cannot be written.
Recovered recover(const std::filesystem::path& in, const std::filesystem::path& out);

/// The same with `open`, which begins at the beginning of the file, and a function that gets the new one.
Recovered recover(const std::function<ReadBytes()>& open, const std::string& file, const std::string& library,
                  const std::function<void(std::string_view)>& write);

}  // namespace runtime::mcap
