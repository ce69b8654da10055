/// @file
/// What a program leaves on the disk, and how much of it survived a failure.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace nth_failure {

/// All files below a folder by their names, read at once.
struct Results {
  std::map<std::string, std::string> files;

  static Results of(const std::filesystem::path& folder);
};

/// What is wrong with `found` beside `expected`, which a run without a failure left: files torn or left over,
/// rows of a recording that are no rows of the expected one, or, when `whole`, anything that is missing.
/// The columns named in `varying` differ from run to run.
std::vector<std::string> flaws(const Results& found, const Results& expected, bool whole,
                               const std::vector<std::string>& varying);

/// Those that a failure cut off, where there is nothing to compare them with.
std::vector<std::string> torn(const Results& found);

}  // namespace nth_failure
