// Each link from one document to another has a target.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include "tests/support/built_paths.h"

namespace links_test {

namespace fs = std::filesystem;

TEST(Links, LeadToFilesThatAreThere) {
  const fs::path root = support::source_dir();
  const std::regex link(R"(\]\(([^)#:\s]+)(#[^)\s]*)?\))");
  int links = 0;
  for (auto entry = fs::recursive_directory_iterator(root); entry != fs::recursive_directory_iterator();
       ++entry) {
    const std::string name = entry->path().filename().string();
    if (entry->is_directory() && (name.starts_with("build") || name.starts_with("."))) {
      entry.disable_recursion_pending();
      continue;
    }
    if (entry->path().extension() != ".md") continue;
    std::ifstream file(entry->path());
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    for (std::sregex_iterator one(text.begin(), text.end(), link); one != std::sregex_iterator(); ++one) {
      EXPECT_TRUE(fs::exists(entry->path().parent_path() / (*one)[1].str()))
          << entry->path() << ": " << one->str();
      ++links;
    }
  }
  EXPECT_GT(links, 20);
}

}  // namespace links_test
