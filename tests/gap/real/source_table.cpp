#include "tests/gap/real/source_table.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

namespace real_recordings {
namespace {

std::vector<std::string> fields(std::string_view line) {
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  std::vector<std::string> result;
  for (std::size_t from = 0; from != std::string_view::npos;) {
    const std::size_t comma = line.find(',', from);
    result.emplace_back(line.substr(from, comma == std::string_view::npos ? comma : comma - from));
    from = comma == std::string_view::npos ? comma : comma + 1;
  }
  return result;
}

}  // namespace

SourceTable::SourceTable(const std::filesystem::path& path) : path_(path.string()) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) throw std::runtime_error(path_ + ": cannot be read");
  names_ = fields(line);
  while (std::getline(file, line)) {
    rows_.push_back(fields(line));
    if (rows_.back().size() != names_.size())
      throw std::runtime_error(path_ + ":" + std::to_string(rows_.size() + 1) + ": has " +
                               std::to_string(rows_.back().size()) + " fields, not " +
                               std::to_string(names_.size()));
  }
  if (rows_.size() < 2) throw std::runtime_error(path_ + ": ends before its second row of values");
}

std::vector<std::string> SourceTable::words(std::string_view name) const {
  const auto found = std::ranges::find(names_, name);
  if (found == names_.end()) throw std::runtime_error(path_ + ": has no column " + std::string(name));
  const auto at = static_cast<std::size_t>(found - names_.begin());
  std::vector<std::string> result;
  result.reserve(rows_.size());
  for (const auto& row : rows_) result.push_back(row[at]);
  return result;
}

std::vector<double> SourceTable::column(std::string_view name) const {
  std::vector<double> values;
  for (const std::string& word : words(name)) {
    std::size_t used = 0;
    double value = 0;
    try {
      value = std::stod(word, &used);
    } catch (const std::logic_error&) {
      used = std::string::npos;
    }
    if (used != word.size() || !std::isfinite(value))
      throw std::runtime_error(path_ + ":" + std::to_string(values.size() + 2) + ": '" + word +
                               "' is no number");
    values.push_back(value);
  }
  return values;
}

}  // namespace real_recordings
