#include "runtime/configuration/closest_name.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace runtime {
namespace {

/// Levenshtein distance: number of letters to insert, delete or replace.
std::size_t edit_distance(std::string_view from, std::string_view to) {
  std::vector<std::size_t> row(to.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < from.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < to.size(); ++j) {
      const std::size_t replaced = diagonal + (from[i] == to[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string closest_name(std::string_view given, const Names& names) {
  return *std::ranges::min_element(names, {},
                                   [given](const std::string& name) { return edit_distance(given, name); });
}

std::optional<std::string> likely_meant(std::string_view given, const Names& names) {
  if (names.empty()) return std::nullopt;
  const std::string name = closest_name(given, names);
  if (3 * edit_distance(given, name) > given.size()) return std::nullopt;
  return name;
}

}  // namespace runtime
