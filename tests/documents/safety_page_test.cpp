// docs/safety.md: each fault names a test that exists.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <string>

#include "tests/support/built_paths.h"

namespace safety_page_test {

TEST(SafetyPage, EachFaultNamesATestThatExists) {
  const std::filesystem::path root = support::source_dir();
  std::ifstream page(root / "docs/safety.md");
  const std::regex row(R"(^\| [A-Z][0-9].*\|$)");
  const std::regex test(R"(`([a-z_/]+_test\.cpp)`)");
  int faults = 0;
  for (std::string line; std::getline(page, line);) {
    if (!std::regex_match(line, row) || line.starts_with("| S")) continue;
    ++faults;
    std::sregex_iterator named(line.begin(), line.end(), test);
    EXPECT_NE(named, std::sregex_iterator()) << line;
    for (; named != std::sregex_iterator(); ++named)
      EXPECT_TRUE(exists(root / "tests" / (*named)[1].str())) << line;
  }
  EXPECT_GT(faults, 10);
}

}  // namespace safety_page_test
