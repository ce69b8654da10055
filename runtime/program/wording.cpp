#include "runtime/program/wording.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string_view>

namespace runtime {
namespace {

/// "wheel-3" → 3, if the name is `stem` and a number.
std::optional<int> number_after(std::string_view name, std::string_view stem) {
  if (!name.starts_with(stem)) return {};
  name.remove_prefix(stem.size());
  int number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (error != std::errc() || end != name.data() + name.size()) return {};
  return number;
}

/// A double has no more.
constexpr int kAllDigits = 17;

std::string digits_text(double value, int digits) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return text.data();
}

bool follow_each_other(std::span<const std::string> names) {
  const std::string_view first = names.front();
  const std::string_view stem = first.substr(0, first.find_last_not_of("0123456789") + 1);
  const std::optional<int> from = number_after(first, stem);
  for (std::size_t i = 0; i < names.size(); ++i)
    if (!from || number_after(names[i], stem) != *from + static_cast<int>(i)) return false;
  return true;
}

}  // namespace

std::string list_text(std::span<const std::string> names) {
  if (names.empty()) return "nothing";
  if (names.size() > 2 && follow_each_other(names)) return names.front() + " to " + names.back();
  std::string text = names.front();
  for (std::size_t i = 1; i < names.size(); ++i) text += (i + 1 == names.size() ? " and " : ", ") + names[i];
  return text;
}

std::string number_text(double value, const std::string& unit) {
  if (!std::isfinite(value)) return "–";
  return digits_text(value, 3) + (unit.empty() ? "" : " " + unit);
}

IntervalText interval_text(double value, double lower, double upper, int value_digits, int bound_digits) {
  const auto parsed = [](const std::string& text) { return std::strtod(text.c_str(), nullptr); };
  IntervalText text{.value = {}, .lower = {}, .upper = {}};
  text.lower = digits_text(lower, bound_digits);
  text.upper = digits_text(upper, bound_digits);
  if (lower < upper && text.lower == text.upper) {
    text.more_digits = true;
    constexpr double kOfWidth = 0.2;
    const auto is_close = [&](const std::string& bound, double exact) {
      return std::abs(parsed(bound) - exact) <= kOfWidth * (upper - lower);
    };
    for (int digits = bound_digits + 1; digits <= kAllDigits; ++digits) {
      text.lower = digits_text(lower, digits);
      text.upper = digits_text(upper, digits);
      value_digits = digits;
      if (is_close(text.lower, lower) && is_close(text.upper, upper)) break;
    }
  }
  for (int digits = value_digits;; ++digits) {
    text.value = digits_text(value, digits);
    if (digits >= kAllDigits || !(lower <= value && value <= upper) ||
        (parsed(text.value) >= parsed(text.lower) && parsed(text.value) <= parsed(text.upper)))
      break;
    text.more_digits = true;
  }
  return text;
}

std::string range_text(std::span<const double> values, const std::string& unit) {
  double least = std::numeric_limits<double>::infinity();
  double greatest = -least;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    least = std::min(least, value);
    greatest = std::max(greatest, value);
  }
  if (least > greatest) return "–";
  const std::string from = number_text(least);
  return from == number_text(greatest) ? number_text(least, unit)
                                       : from + " to " + number_text(greatest, unit);
}

std::string count_text(long long count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace runtime
