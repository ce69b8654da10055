#include "runtime/fixed_text.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>

namespace runtime {
namespace {

constexpr std::array<std::uint64_t, 13> kPowersOfTen{
    1,          10,          100,           1'000,          10'000,          100'000,          1'000'000,
    10'000'000, 100'000'000, 1'000'000'000, 10'000'000'000, 100'000'000'000, 1'000'000'000'000};

/// Scales the value to an integer where the error of the scaling cannot change the rounding. Null where it
/// could.
char* write_scaled(char* out, char* end, double value, int decimals) noexcept {
  constexpr double kLargest = 1e12;     // doubles are 1e-4 apart there
  constexpr double kCertainly = 0.499;  // from the nearest integer
  if (decimals >= static_cast<int>(kPowersOfTen.size())) return nullptr;
  const std::uint64_t power = kPowersOfTen[static_cast<std::size_t>(decimals)];
  const double scaled = std::abs(value) * static_cast<double>(power);
  if (!(scaled < kLargest)) return nullptr;
  const double half_above = scaled + 0.5;  // values that round incorrectly are left to std::to_chars below
  const auto digits = static_cast<std::uint64_t>(half_above);
  if (std::abs(scaled - static_cast<double>(digits)) > kCertainly) return nullptr;
  auto whole = static_cast<std::uint64_t>(std::abs(value));
  std::uint64_t part = digits - whole * power;
  if (part == power) {  // rounded up
    ++whole;
    part = 0;
  }
  if (std::signbit(value)) *out++ = '-';
  out = std::to_chars(out, end, whole).ptr;
  if (decimals == 0) return out;
  // A leading one keeps the zeros of the decimals; the point then replaces it.
  char* const point = out;
  out = std::to_chars(out, end, power + part).ptr;
  *point = '.';
  return out;
}

}  // namespace

char* write_fixed(char* out, char* end, double value, int decimals) noexcept {
  if (char* const behind = write_scaled(out, end, value, decimals)) return behind;
  return std::to_chars(out, end, value, std::chars_format::fixed, decimals).ptr;
}

}  // namespace runtime
