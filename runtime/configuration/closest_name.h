/// @file
/// Suggestions for a misspelled name.
#pragma once
#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace runtime {

using Names = std::set<std::string, std::less<>>;

/// The name that differs from `given` in the fewest letters. `names` is not empty.
std::string closest_name(std::string_view given, const Names& names);

/// The same if it is close enough for `given` to be a misspelling of it.
std::optional<std::string> likely_meant(std::string_view given, const Names& names);

}  // namespace runtime
