#include "runtime/recording/csv_format.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>

#include "runtime/fixed_text.h"

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

/// The caller has reserved longest_value_chars().
char* format_value(char* out, char* end, double value, const std::optional<int>& decimals) noexcept {
  // One spelling; to_chars would distinguish -nan from nan.
  if (std::isnan(value)) return std::ranges::copy(std::string_view("nan"), out).out;
  if (!decimals) return std::to_chars(out, end, value).ptr;
  return write_fixed(out, end, value, *decimals);
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
