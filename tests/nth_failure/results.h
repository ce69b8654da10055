/// @file
/// Files that a program leaves on the disk, and how much of them survived a failure.
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

/// Flaws of `found` compared with `expected` from a run without a failure: torn or left-over files, rows of a
/// recording that are not rows of the expected one, or, if `whole`, anything that is missing. The columns in
/// `varying` differ between runs.
std::vector<std::string> flaws(const Results& found, const Results& expected, bool whole,
                               const std::vector<std::string>& varying);

/// Files cut off by a failure, if there is nothing to compare them with.
std::vector<std::string> torn(const Results& found);

}  // namespace nth_failure
