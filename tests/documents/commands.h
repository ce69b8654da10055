/// @file
/// Commands in a document, for tests that run them.
#pragma once
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace documents {

/// A fenced block of a Markdown file.
struct Block {
  std::string language;  ///< after the fence, may be empty
  std::string heading;   ///< the last one before it
  std::vector<std::string> lines;
};
/// For the messages of a test.
inline void PrintTo(const Block& block, std::ostream* out) { *out << block.heading; }
/// @throws std::runtime_error if the file cannot be read or a fence is not closed.
std::vector<Block> fenced_blocks(const std::filesystem::path& document);

/// A command of a block, with its continuation lines joined, and its documented output.
struct Step {
  std::string command;
  std::vector<std::string> printed{};
};
/// For a block that shows a terminal: commands after "$ ", the rest is output.
std::vector<Step> console_steps(const Block& block);
/// For a block that contains only commands.
std::vector<Step> command_steps(const Block& block);

/// The first of the lines that is missing in the output, in order; empty if none is. A line that ends in " …"
/// is a prefix. Numbers may differ by 5 %: they result from a search, which ends slightly differently with
/// other rounding.
std::string first_missing(const std::vector<std::string>& lines, const std::string& output);

/// A directory that looks like the repository after a build, without files of others.
class Checkout {
 public:
  Checkout();
  /// With bash, in its top directory.
  support::CommandResult run(const std::string& command) const;
  void write(const std::string& name, const std::vector<std::string>& lines) const;
  std::filesystem::path operator/(const std::string& name) const { return directory_ / name; }

 private:
  support::TemporaryDirectory directory_;
};

}  // namespace documents
