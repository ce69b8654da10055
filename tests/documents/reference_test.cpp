// The reference of the library: Doxygen finds no mistake, and every promised name has a page.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>

#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace reference_test {

namespace fs = std::filesystem;

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// The first group of each match.
std::set<std::string> all(const std::string& text, const char* pattern) {
  const std::regex regex(pattern);
  std::set<std::string> found;
  for (std::sregex_iterator at(text.begin(), text.end(), regex), end; at != end; ++at) found.insert((*at)[1]);
  return found;
}

TEST(Reference, HasEachPromisedNameAndNoWarning) {
  const support::TemporaryDirectory folder;
  const std::string output = folder.path().string();
  const support::CommandResult made = support::run_command(
      "cd " + support::source_dir() + " && { cat docs/Doxyfile; echo OUTPUT_DIRECTORY=" + output +
      "; echo GENERATE_TAGFILE=" + output + "/names; } | doxygen -");
  ASSERT_EQ(made.exit_code, 0) << made.output;
  EXPECT_EQ(made.output, "") << "warnings";

  const std::string tags = text_of(folder / "names");
  const std::set<std::string> classes = all(tags, "<name>((?:\\w+::)+\\w+)</name>");
  const std::set<std::string> members = all(tags, "<name>(\\w+)</name>\\s*<anchorfile>");
  std::size_t promised = 0;
  for (const fs::directory_entry& header :
       fs::directory_iterator(fs::path(support::source_dir()) / "include/youbot"))
    for (const std::string& name : all(text_of(header.path()), "\nusing (?:\\w+ = )?((?:\\w+::)+\\w+);")) {
      ++promised;
      EXPECT_TRUE(classes.contains(name) || members.contains(name.substr(name.rfind(':') + 1)))
          << header.path() << ": " << name;
    }
  EXPECT_GT(promised, 70U);
}

}  // namespace reference_test
