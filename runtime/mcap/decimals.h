/// @file
/// Numbers with a fixed number of decimals as doubles that compress well.
///
/// The double nearest to 0.123457 has 52 random bits, which no compression shortens. Its column has six
/// decimals: any double within half of the last one stands for the same number. A multiple of 2^-20 is such a
/// double; the rest of its bits are zero. A base recording takes half of the space this way.
#pragma once

namespace runtime::mcap {

/// The multiple of a power of two that stands for `value`. `decimals`: up to RecordingFile::kMaxDecimals.
double rounded_to_binary(double value, int decimals) noexcept;
/// The double nearest to the decimal number that `value` stands for. Undoes rounded_to_binary() exactly for
/// a number of that many decimals.
double rounded_to_decimal(double value, int decimals) noexcept;

}  // namespace runtime::mcap
