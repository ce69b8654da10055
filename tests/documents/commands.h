/// @file
/// What a document tells its reader to type, for tests that type it.
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
/// @throws std::runtime_error when the file cannot be read or a fence is not closed.
std::vector<Block> fenced_blocks(const std::filesystem::path& document);

/// A command of a block, its continued lines joined, and what the document says that it prints.
struct Step {
  std::string command;
  std::vector<std::string> printed{};
};
/// Of a block as a terminal shows it: commands after "$ ", all else is printed.
std::vector<Step> console_steps(const Block& block);
/// Of a block that holds nothing but commands.
std::vector<Step> command_steps(const Block& block);

/// The first of the lines that is not in the output, in their order; empty when all are. A line that ends in
/// " …" is the beginning of one. Numbers may differ by 5 %: they come out of a search, which ends a little
/// elsewhere where the processor rounds otherwise.
std::string first_missing(const std::vector<std::string>& lines, const std::string& output);

/// A directory that looks as the repository does to one who built it, with no file of anybody else in it.
class Checkout {
 public:
  Checkout();
  /// By bash, from the top of it.
  support::CommandResult run(const std::string& command) const;
  void write(const std::string& name, const std::vector<std::string>& lines) const;
  std::filesystem::path operator/(const std::string& name) const { return directory_ / name; }

 private:
  support::TemporaryDirectory directory_;
};

}  // namespace documents
