#include "tests/documents/commands.h"
#include "tests/support/built_paths.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string_view>

namespace documents {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFence = "```";
constexpr std::string_view kAndSoOn = " …";

/// The number that `text` begins with; 0 characters of it when there is none.
std::pair<double, std::size_t> leading_number(const std::string& text) {
  const bool is_number =
      std::isdigit(static_cast<unsigned char>(text[0])) != 0 ||
      (text[0] == '-' && text.size() > 1 && std::isdigit(static_cast<unsigned char>(text[1])) != 0);
  if (!is_number) return {0, 0};
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return {value, static_cast<std::size_t>(end - text.c_str())};
}

bool same(std::string stated, std::string line) {
  const bool begins_only = stated.ends_with(kAndSoOn);
  if (begins_only) stated.resize(stated.size() - kAndSoOn.size());
  while (!stated.empty() && !line.empty()) {
    const auto [wanted, wanted_length] = leading_number(stated);
    const auto [value, length] = leading_number(line);
    if (wanted_length > 0 && length > 0) {
      if (std::abs(value - wanted) > 0.05 * std::abs(wanted)) return false;
      stated.erase(0, wanted_length);
      line.erase(0, length);
    } else {
      if (stated[0] != line[0]) return false;
      stated.erase(0, 1);
      line.erase(0, 1);
    }
  }
  return stated.empty() && (line.empty() || begins_only);
}

}  // namespace

std::vector<Block> fenced_blocks(const fs::path& document) {
  std::ifstream file(document);
  if (!file) throw std::runtime_error(document.string() + ": cannot be read");
  std::vector<Block> blocks;
  std::string heading;
  bool inside = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(kFence)) {
      inside = !inside;
      if (inside) blocks.push_back({line.substr(kFence.size()), heading, {}});
    } else if (inside) {
      blocks.back().lines.push_back(line);
    } else if (line.starts_with("#")) {
      heading = line.substr(line.find_first_not_of("# "));
    }
  }
  if (inside) throw std::runtime_error(document.string() + ": the last block has no end");
  return blocks;
}

std::vector<Step> console_steps(const Block& block) {
  std::vector<Step> steps;
  bool continued = false;
  for (const std::string& line : block.lines) {
    if (line.starts_with("$ "))
      steps.push_back({line.substr(2)});
    else if (steps.empty())
      throw std::runtime_error(block.heading + ": prints before its first command: " + line);
    else if (continued)
      steps.back().command += "\n" + line;
    else
      steps.back().printed.push_back(line);
    continued = (line.starts_with("$ ") || continued) && line.ends_with("\\");
  }
  return steps;
}

std::vector<Step> command_steps(const Block& block) {
  std::vector<Step> steps;
  bool continued = false;
  for (const std::string& line : block.lines) {
    if (continued)
      steps.back().command += "\n" + line;
    else
      steps.push_back({line});
    continued = line.ends_with("\\");
  }
  return steps;
}

std::string first_missing(const std::vector<std::string>& lines, const std::string& output) {
  std::istringstream printed(output);
  for (const std::string& wanted : lines) {
    std::string line;
    bool found = false;
    while (!found && std::getline(printed, line)) found = same(wanted, line);
    if (!found) return wanted;
  }
  return {};
}

Checkout::Checkout() {
  fs::create_directory(directory_ / "build");
  fs::create_directory_symlink(support::program_dir(), directory_ / "build/bin");
  for (const char* folder : {"apps", "tests"})
    fs::create_directory_symlink(fs::path(support::source_dir()) / folder, directory_ / folder);
}

support::CommandResult Checkout::run(const std::string& command) const {
  const fs::path script = directory_.write("command.sh", command + "\n");
  const std::string here = "'" + directory_.path().string() + "'";
  return support::run_command("cd " + here + " && TMPDIR=" + here + " bash '" + script.string() + "'");
}

void Checkout::write(const std::string& name, const std::vector<std::string>& lines) const {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  directory_.write(name, text);
}

}  // namespace documents
