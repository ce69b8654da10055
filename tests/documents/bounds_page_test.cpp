// docs/bounds.md: each bound is in its file with its value, each test exists, and no bound is missing.
#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/built_paths.h"

namespace bounds_page_test {

namespace fs = std::filesystem;

const fs::path kRoot = support::source_dir();

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// What stands between backticks.
std::vector<std::string> code_spans(const std::string& cell) {
  const std::regex span("`([^`]+)`");
  std::vector<std::string> found;
  for (std::sregex_iterator at(cell.begin(), cell.end(), span), end; at != end; ++at)
    found.push_back((*at)[1]);
  return found;
}

struct Bound {
  std::string row;
  std::vector<std::string> values;
  std::vector<std::string> files;
  std::vector<std::string> tests;  ///< a file, and behind it what of it shows the bound
};

std::vector<Bound> bounds() {
  std::istringstream page(text_of(kRoot / "docs/bounds.md"));
  std::vector<Bound> rows;
  for (std::string line; std::getline(page, line);) {
    if (!line.starts_with("| ") || line.starts_with("| what |") || line.starts_with("| wait |")) continue;
    std::istringstream row(line.substr(2));
    std::vector<std::string> cells;
    for (std::string cell; std::getline(row, cell, '|');) cells.push_back(cell);
    if (cells.size() < 5) {
      ADD_FAILURE() << "not five cells: " << line;
      continue;
    }
    rows.push_back({line, code_spans(cells[1]), code_spans(cells[2]), code_spans(cells[4])});
  }
  return rows;
}

std::vector<fs::path> sources(const std::vector<std::string>& folders) {
  std::vector<fs::path> found;
  for (const std::string& folder : folders)
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kRoot / folder))
      if (entry.path().extension() == ".h" || entry.path().extension() == ".cpp")
        found.push_back(entry.path());
  return found;
}

/// Whether `value` is there as a whole: 25 is not in 256.
bool holds(const std::string& text, const std::string& value) {
  for (std::size_t at = text.find(value); at != std::string::npos; at = text.find(value, at + 1)) {
    const char next = at + value.size() < text.size() ? text[at + value.size()] : ' ';
    if (std::isalnum(static_cast<unsigned char>(next)) == 0 && next != '\'' && next != '_') return true;
  }
  return false;
}

TEST(BoundsPage, EachBoundIsInItsFileWithItsValue) {
  const std::vector<Bound> all = bounds();
  EXPECT_GT(all.size(), 90U);
  for (const Bound& bound : all) {
    ASSERT_FALSE(bound.files.empty()) << bound.row;
    std::string text;
    for (const std::string& file : bound.files) text += text_of(kRoot / file);
    for (const std::string& value : bound.values)
      EXPECT_TRUE(holds(text, value)) << value << " is not in it: " << bound.row;
  }
}

TEST(BoundsPage, EachTestExists) {
  for (const Bound& bound : bounds()) {
    std::string text;
    for (const std::string& name : bound.tests) {
      if (name.ends_with(".cpp")) {
        text = text_of(kRoot / "tests" / name);
        continue;
      }
      const std::size_t dot = name.find('.');
      const std::string definition = "(" + name.substr(0, dot) + ", " + name.substr(dot + 1) + ")";
      EXPECT_NE(text.find(definition), std::string::npos) << name << ": " << bound.row;
    }
  }
}

TEST(BoundsPage, NoConstantThatIsNamedLikeABoundIsMissing) {
  const std::string page = text_of(kRoot / "docs/bounds.md");
  const std::regex constant(
      R"(constexpr [^;={\n]*\b(k(?:Most|Max|Longest|Largest|Highest|Fewest)[A-Z_]\w*|k\w*(?:Capacity|Timeout|Patience|Attempts|Frames|Queue|Queued)|kLargest|kHighest)\b *[={])");
  std::map<std::string, fs::path> found;
  for (const fs::path& path : sources({"drivers", "hal", "model", "control", "runtime", "live", "ros2",
                                       "apps", "sim/bus", "sim/can", "sim/devices"})) {
    const std::string text = text_of(path);
    for (std::sregex_iterator at(text.begin(), text.end(), constant), end; at != end; ++at)
      found.emplace((*at)[1], path);
  }
  EXPECT_GT(found.size(), 80U);
  for (const auto& [name, path] : found) EXPECT_TRUE(holds(page, "`" + name)) << name << " in " << path;
  for (const std::string& name : code_spans(page.substr(page.find("Named like a bound"))))
    EXPECT_TRUE(found.contains(name)) << name << " is there no more";
}

TEST(BoundsPage, NoCheckVanishesInReleaseBuilds) {
  const std::regex assertion(R"((^|[^_\w])assert\()");
  for (const fs::path& path : sources({"drivers", "hal", "model", "control", "sim", "identification",
                                       "runtime", "live", "ros2", "apps"}))
    EXPECT_FALSE(std::regex_search(text_of(path), assertion)) << path;
}

}  // namespace bounds_page_test
