/// @file
/// Texts shared by messages and reports of the search.
#pragma once
#include <array>
#include <charconv>
#include <cmath>
#include <string>

#include "identification/gap/gap.h"

namespace identification::gap {

/// "0.00123", "1000"
inline std::string short_number(double value) {
  std::array<char, 32> text{};
  const bool is_long = std::abs(value) >= 999.5 && std::abs(value) < 1e6;
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value,
                    is_long ? std::chars_format::fixed : std::chars_format::general, is_long ? 0 : 3);
  return {text.data(), end.ptr};
}

inline const std::string& path_of(const Source& source) {
  return source.path.empty() ? source.name : source.path;
}

}  // namespace identification::gap
