#include "tests/nth_failure/results.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>

namespace nth_failure {
namespace {

namespace fs = std::filesystem;

/// Header and rows of a recording without its comments and the columns that vary.
struct Recording {
  std::vector<std::string> lines{};
  bool torn = false;
};

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream text(line);
  for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
  return cells;
}

Recording recording_of(const std::string& text, const std::vector<std::string>& varying) {
  Recording recording{.torn = text.empty() || text.back() != '\n'};
  std::vector<std::string> names;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) continue;
    const std::vector<std::string> cells = cells_of(line);
    if (names.empty()) names = cells;
    recording.torn = recording.torn || cells.size() != names.size();
    std::string kept;
    for (std::size_t i = 0; i < std::min(cells.size(), names.size()); ++i)
      if (std::find(varying.begin(), varying.end(), names[i]) == varying.end()) kept += cells[i] + ",";
    recording.lines.push_back(kept);
  }
  return recording;
}

bool is_recording(const std::string& name) { return name.ends_with(".csv"); }

/// The sign of a truncated file.
bool is_torn(const std::string& name, const std::string& text) {
  if (name.ends_with(".pcapng")) return text.empty();  // binary
  if (name.ends_with(".html")) return text.find("</html>") == std::string::npos;
  return text.empty() || text.back() != '\n';
}

std::string flaw_of_recording(const std::string& text, const std::string& expected, bool whole,
                              const std::vector<std::string>& varying) {
  const Recording found = recording_of(text, varying);
  const Recording model = recording_of(expected, varying);
  if (found.torn) return "is torn";
  auto at = model.lines.begin();
  for (const std::string& line : found.lines) {
    at = std::find(at, model.lines.end(), line);
    if (at == model.lines.end()) return "has a row that was not recorded: " + line;
    ++at;
  }
  if (whole && found.lines.size() != model.lines.size())
    return "has " + std::to_string(found.lines.size()) + " of " + std::to_string(model.lines.size()) +
           " rows";
  return {};
}

}  // namespace

Results Results::of(const fs::path& folder) {
  Results results;
  if (!fs::exists(folder)) return results;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream file(entry.path(), std::ios::binary);
    // A report on a fault has the time and the process in its name.
    static const std::regex kReport("youbotd-fault-.*-1");
    const std::string name =
        std::regex_replace(fs::relative(entry.path(), folder).string(), kReport, "youbotd-fault");
    results.files[name] = {std::istreambuf_iterator<char>(file), {}};
  }
  return results;
}

std::vector<std::string> flaws(const Results& found, const Results& expected, bool whole,
                               const std::vector<std::string>& varying) {
  std::vector<std::string> all;
  for (const auto& [name, text] : found.files) {
    const auto model = expected.files.find(name);
    if (model == expected.files.end())
      all.push_back(name + " was left over");
    else if (is_recording(name)) {
      if (const std::string flaw = flaw_of_recording(text, model->second, whole, varying); !flaw.empty())
        all.push_back(name + " " + flaw);
    } else if (is_torn(name, text) && (whole || !name.ends_with(".toml")))
      all.push_back(name + " is torn");
  }
  if (whole)
    for (const auto& [name, text] : expected.files)
      if (!found.files.contains(name)) all.push_back(name + " is missing");
  return all;
}

std::vector<std::string> torn(const Results& found) {
  std::vector<std::string> names;
  for (const auto& [name, text] : found.files)
    if (is_recording(name) ? recording_of(text, {}).torn : is_torn(name, text)) names.push_back(name);
  return names;
}

}  // namespace nth_failure
