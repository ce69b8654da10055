/// @file
/// Numbers with a fixed number of decimals as doubles or integers that compress well.
///
/// The double nearest to 0.123457 has 52 random bits, which no compression shortens. Its column has six
/// decimals: any double within half of the last one stands for the same number. A multiple of 2^-20 is such a
/// double; the rest of its bits are zero. A base recording takes half of the space this way.
#pragma once
#include <cstdint>
#include <optional>

namespace runtime::mcap {

/// The multiple of a power of two that stands for `value`. `decimals`: up to RecordingFile::kMaxDecimals.
double rounded_to_binary(double value, int decimals) noexcept;

/// The number of that many decimals nearest to `value`, the same as text has, as a count of half units of the
/// last one: 2·n, or -1 for the negative zero. Empty if it is not finite or too large.
std::optional<std::int64_t> in_half_units(double value, int decimals) noexcept;
/// The double nearest to that number.
double from_half_units(std::int64_t half_units, int decimals) noexcept;

}  // namespace runtime::mcap
