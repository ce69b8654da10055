#include "runtime/recording/csv_format.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>

namespace runtime {
namespace {

constexpr std::string_view kFirstLine = "# youbot recording v1\n";
/// Two to three flush intervals of a 1 kHz recording with a dozen columns.
constexpr std::size_t kBufferBytes = 64 * 1024;
/// Shortest text of a double: sign, 17 digits, point, "e-308".
constexpr std::size_t kLongestShortestChars = 24;
/// Fixed notation writes all digits of the largest double: sign, 309 digits, point, then the decimals.
constexpr std::size_t kLongestFixedChars = 2 + std::numeric_limits<double>::max_exponent10 + 1;

std::size_t longest_value_chars(const std::optional<int>& decimals) {
  return decimals ? kLongestFixedChars + static_cast<std::size_t>(*decimals) : kLongestShortestChars;
}

/// Same result as std::to_chars() with fixed decimals, in a fifth of the time: the value is scaled to an
/// integer where the error of the scaling cannot change the rounding. Null where it could.
char* format_scaled(char* out, char* end, double value, int decimals) noexcept {
  constexpr std::array<double, 10> kPowers{1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
  constexpr std::array<std::uint64_t, 10> kWholePowers{
      1, 10, 100, 1'000, 10'000, 100'000, 1'000'000, 10'000'000, 100'000'000, 1'000'000'000};
  constexpr double kLargest = 1e12;     // doubles are 1e-4 apart there
  constexpr double kCertainly = 0.499;  // from the nearest integer
  if (decimals >= static_cast<int>(kPowers.size())) return nullptr;
  const double scaled = std::abs(value) * kPowers[static_cast<std::size_t>(decimals)];
  if (!(scaled < kLargest)) return nullptr;
  const double half_above = scaled + 0.5;  // values that round incorrectly are left to std::to_chars below
  const auto digits = static_cast<std::uint64_t>(half_above);
  if (std::abs(scaled - static_cast<double>(digits)) > kCertainly) return nullptr;
  const std::uint64_t power = kWholePowers[static_cast<std::size_t>(decimals)];
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

/// The caller has reserved longest_value_chars().
char* format_value(char* out, char* end, double value, const std::optional<int>& decimals) noexcept {
  // One spelling; to_chars would distinguish -nan from nan.
  if (std::isnan(value)) return std::ranges::copy(std::string_view("nan"), out).out;
  if (!decimals) return std::to_chars(out, end, value).ptr;
  if (char* const behind = format_scaled(out, end, value, *decimals)) return behind;
  return std::to_chars(out, end, value, std::chars_format::fixed, *decimals).ptr;
}

std::string make_header(const std::vector<RecordingFile::Comment>& comments,
                        const std::vector<RecordingFile::Column>& columns) {
  std::string header(kFirstLine);
  for (const auto& [key, value] : comments) header += "# " + key + ": " + value + '\n';
  for (const RecordingFile::Column& column : columns)
    header += (&column == columns.data() ? "" : ",") + column.name;
  return header + '\n';
}

}  // namespace

CsvFormat::CsvFormat(const std::vector<RecordingFile::Comment>& comments,
                     const std::vector<RecordingFile::Column>& columns)
    : head_(make_header(comments, columns)) {
  for (const RecordingFile::Column& column : columns) {
    decimals_.push_back(column.decimals);
    longest_row_bytes_ += longest_value_chars(column.decimals) + 1;  // comma or line end
  }
  buffer_.resize(std::max(kBufferBytes, longest_row_bytes_));
}

bool CsvFormat::append_row(std::span<const double> values) noexcept {
  char* out = buffer_.data() + buffered_bytes_;
  char* const end = buffer_.data() + buffer_.size();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0) *out++ = ',';
    out = format_value(out, end, values[i], decimals_[i]);
  }
  *out++ = '\n';
  buffered_bytes_ = static_cast<std::size_t>(out - buffer_.data());
  ++buffered_rows_;
  return true;
}

std::uint64_t CsvFormat::write_to(AppendFile& file) noexcept {
  const std::span<const char> rows(buffer_.data(), buffered_bytes_);
  const std::size_t kept = file.append(rows, [](std::span<const char> reached) {
    return static_cast<std::size_t>(std::find(reached.rbegin(), reached.rend(), '\n').base() -
                                    reached.begin());
  });
  const std::uint64_t rows_kept =
      kept == rows.size() ? buffered_rows_
                          : static_cast<std::uint64_t>(std::ranges::count(rows.first(kept), '\n'));
  discard_rows();
  return rows_kept;
}

}  // namespace runtime
