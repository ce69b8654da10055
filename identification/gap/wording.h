/// @file
/// Texts shared by messages and reports of the search.
#pragma once
#include <array>
#include <charconv>
#include <string>

#include "identification/gap/gap.h"

namespace identification::gap {

/// "0.00123"
inline std::string short_number(double value) {
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 3);
  return {text.data(), end.ptr};
}

inline const std::string& path_of(const Source& source) {
  return source.path.empty() ? source.name : source.path;
}

}  // namespace identification::gap
