#include "runtime/mcap/decimals.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>

#include "runtime/recording/recording_file.h"

namespace runtime::mcap {
namespace {

/// In units of the last decimal. Up to here the errors of storing and scaling, 2^-52 of a number together,
/// cannot change what it is rounded to: a step is up to 0.977 units, so its half leaves 0.011.
constexpr double kCertain = 1LL << 45;

constexpr auto kPowersOfTen = [] {
  std::array<double, RecordingFile::kMaxDecimals + 1> powers{};  // exact up to 10^22
  double power = 1;
  for (double& each : powers) {
    each = power;
    power *= 10;
  }
  return powers;
}();

/// The largest power of two below 10^decimals times two: its inverse is the coarsest step whose half is less
/// than half of the last decimal.
constexpr auto kInverseSteps = [] {
  std::array<double, RecordingFile::kMaxDecimals + 1> inverses{};
  double inverse = 2;
  for (std::size_t i = 0; i < inverses.size(); ++i) {
    while (inverse <= kPowersOfTen[i]) inverse *= 2;
    inverses[i] = inverse;
  }
  return inverses;
}();

}  // namespace

double rounded_to_binary(double value, int decimals) noexcept {
  const double scaled = value * kInverseSteps[static_cast<std::size_t>(decimals)];
  // Large numbers, NaN and infinity pass unchanged.
  return std::abs(scaled) < kCertain
             ? std::nearbyint(scaled) / kInverseSteps[static_cast<std::size_t>(decimals)]
             : value;
}

std::optional<std::int64_t> in_half_units(double value, int decimals) noexcept {
  const double scaled = value * kPowersOfTen[static_cast<std::size_t>(decimals)];
  if (!(std::abs(scaled) < kCertain)) return std::nullopt;
  double count = std::nearbyint(scaled);
  constexpr double kCertainly = 0.49;  // from the nearest integer; otherwise the scaling may have moved it
  if (std::abs(scaled - count) > kCertainly) {
    std::array<char, 64> text{};
    const char* const end =
        std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, decimals).ptr;
    std::from_chars(text.data(), end, count);
    count = std::nearbyint(count * kPowersOfTen[static_cast<std::size_t>(decimals)]);
  }
  if (count == 0) return std::signbit(value) ? -1 : 0;
  return 2 * static_cast<std::int64_t>(count);
}

double from_half_units(std::int64_t half_units, int decimals) noexcept {
  if (half_units == -1) return -0.0;
  const std::int64_t units = half_units / 2;
  // The quotient of two exact numbers is the nearest double.
  return static_cast<double>(units) / kPowersOfTen[static_cast<std::size_t>(decimals)];
}

}  // namespace runtime::mcap
