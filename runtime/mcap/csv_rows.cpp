#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/configuration/toml_reader.h"
#include "runtime/mcap/decimals.h"
#include "runtime/mcap/recording_rows.h"
#include "runtime/recording/lines.h"
#include "runtime/recording/recording_reader.h"

namespace runtime::mcap {
namespace {

std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ') || text.starts_with('\t')) text.remove_prefix(1);
  while (text.ends_with(' ') || text.ends_with('\t')) text.remove_suffix(1);
  return text;
}

/// Whether the text of this number, with so many decimals, can be written again from what is stored.
bool is_reproduced(std::string_view text, double value, int decimals) {
  std::array<char, std::numeric_limits<double>::max_exponent10 + 2 + RecordingFile::kMaxDecimals + 1> again{};
  const auto half_units = in_half_units(value, decimals);
  const double stored = half_units ? from_half_units(*half_units, decimals) : value;
  const char* const end =
      std::to_chars(again.data(), again.data() + again.size(), stored, std::chars_format::fixed, decimals)
          .ptr;
  return text == std::string_view(again.data(), static_cast<std::size_t>(end - again.data()));
}

/// Calls it; adds the path to a failure of the file system.
template <typename Call>
auto named(const std::filesystem::path& path, Call call) {
  try {
    return call();
  } catch (const std::runtime_error& error) {
    throw ConfigError({path.string() + ": " + error.what()});
  }
}

/// One pass over the file.
class CsvPass {
 public:
  explicit CsvPass(const std::filesystem::path& path)
      : path_(path),
        file_(named(path, [&path] { return std::make_unique<RegularFile>(path); })),
        lines_(*file_, kMaxRecordingBytes) {}

  RecordingHead read_head() {
    RecordingHead head;
    std::string_view line;
    bool whole = true;
    while (next_line(line, whole)) {
      if (line.empty()) continue;
      if (!line.starts_with('#')) {
        read_names(line, head);
        return head;
      }
      const std::string_view text = trimmed(line.substr(1));
      if (text.starts_with("youbot recording")) {
        if (text != "youbot recording v1") fail("this is '" + std::string(text) + "', but v1 is read");
        continue;
      }
      const std::size_t colon = text.find(':');
      if (colon != text.npos && colon > 0)
        head.comments.push_back(
            {std::string(trimmed(text.substr(0, colon))), std::string(trimmed(text.substr(colon + 1)))});
    }
    fail("no row of column names");
  }

  /// Calls field(column, text, value) for each, then end_of_row(), which says whether to go on. False if the
  /// last line is torn.
  template <typename Field, typename EndOfRow>
  bool read_rows(const RecordingHead& head, Field field, EndOfRow end_of_row) {
    std::string_view line;
    bool whole = true;
    while (next_line(line, whole)) {
      if (!whole) return false;
      if (line.empty()) continue;
      std::size_t column = 0;
      for (std::string_view rest = line;; ++column) {
        const std::size_t comma = rest.find(',');
        if (column >= head.columns.size()) break;
        const std::string_view text = rest.substr(0, comma);
        const std::string_view number = trimmed(text);
        double value = 0;
        const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
        if (error != std::errc() || end != number.data() + number.size())
          fail(head.columns[column].name + " is not a number");
        field(column, text, value);
        if (comma == rest.npos) break;
        rest.remove_prefix(comma + 1);
      }
      if (column + 1 != head.columns.size())
        fail("the row does not have " + std::to_string(head.columns.size()) + " values");
      if (!end_of_row()) break;
    }
    return true;
  }

  std::string placed(const std::string& text) const {
    return path_.string() + (line_ > 0 ? ":" + std::to_string(line_) : "") + ": " + text;
  }
  [[noreturn]] void fail(const std::string& problem) const { throw ConfigError({placed(problem)}); }

 private:
  bool next_line(std::string_view& line, bool& whole) {
    if (!named(path_, [&] { return lines_.next(line, whole); })) return false;
    if (++line_ == 1 && line.starts_with(kByteOrderMark)) line.remove_prefix(kByteOrderMark.size());
    return true;
  }

  void read_names(std::string_view line, RecordingHead& head) {
    for (;;) {
      const std::size_t comma = line.find(',');
      const std::string name(trimmed(line.substr(0, comma)));
      if (name.empty() || name.find_first_of(" \t\"#") != name.npos)
        fail("column '" + name + "': a name has no blank, quotation mark or #");
      if (head.column(name)) fail("column " + name + " is there twice");
      head.columns.push_back({name});
      if (head.columns.size() > kMaxRecordingColumns)
        fail("more than " + std::to_string(kMaxRecordingColumns) +
             " columns; is this the row of column names?");
      if (comma == line.npos) break;
      line.remove_prefix(comma + 1);
    }
    if (!head.column("time_s")) fail("column time_s is missing; is this the row of column names?");
  }

  static constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

  const std::filesystem::path& path_;
  std::unique_ptr<RegularFile> file_;
  Lines lines_;
  std::size_t line_ = 0;
};

/// Finds the decimals of each column that always has the same number of them. Returns the number of rows.
std::uint64_t find_decimals(CsvPass& pass, RecordingHead& head) {
  std::uint64_t rows = 0;
  constexpr int kUnknown = -1;
  std::vector<std::optional<int>> decimals(head.columns.size(), kUnknown);
  pass.read_rows(
      head,
      [&](std::size_t column, std::string_view text, double value) {
        std::optional<int>& digits = decimals[column];
        if (!digits || text == "nan") return;
        const std::size_t point = text.find('.');
        const int here = point == text.npos ? 0 : static_cast<int>(text.size() - point - 1);
        if ((*digits != kUnknown && *digits != here) || here > RecordingFile::kMaxDecimals ||
            !is_reproduced(text, value, here))
          digits.reset();
        else
          digits = here;
      },
      [&rows] {
        ++rows;
        return true;
      });
  for (std::size_t i = 0; i < decimals.size(); ++i)
    if (decimals[i] != kUnknown) head.columns[i].decimals = decimals[i];
  return rows;
}

/// What a recording does not have: each kind is reported at its first row.
class RowOddities {
 public:
  explicit RowOddities(const RecordingHead& head) : head_(head), time_(*head.column("time_s")) {}

  std::vector<std::string> of(std::span<const double> row) {
    std::vector<std::string> found;
    const double time_s = row[time_];
    if (time_s == last_s_ && !std::exchange(repeated_, true))
      found.push_back(fmt::format("time_s = {} is that of the row before", time_s));
    if (time_s < last_s_ && !std::exchange(decreased_, true))
      found.push_back(fmt::format("time_s = {} is less than {} in the row before", time_s, last_s_));
    last_s_ = time_s;
    const auto infinite = std::ranges::find_if(row, [](double value) { return std::isinf(value); });
    if (infinite != row.end() && !std::exchange(infinite_, true))
      found.push_back(fmt::format("{} is infinite",
                                  head_.columns[static_cast<std::size_t>(infinite - row.begin())].name));
    return found;
  }

 private:
  const RecordingHead& head_;
  std::size_t time_;
  double last_s_ = -std::numeric_limits<double>::infinity();
  bool repeated_ = false;
  bool decreased_ = false;
  bool infinite_ = false;
};

}  // namespace

void read_csv_rows(const std::filesystem::path& path, const RowVisitor& visitor) {
  CsvPass survey(path);
  RecordingHead head = survey.read_head();
  std::uint64_t left = find_decimals(survey, head);
  CsvPass pass(path);
  if (pass.read_head().columns.size() != head.columns.size()) pass.fail("the file changes while it is read");
  visitor.head(head);
  const auto warn = [&](const std::string& text) {
    if (visitor.warning) visitor.warning(pass.placed(text));
  };
  std::vector<double> row(head.columns.size());
  RowOddities oddities(head);
  const bool whole = pass.read_rows(
      head, [&](std::size_t column, std::string_view, double value) { row[column] = value; },
      [&] {
        if (left == 0) {  // nothing is known of its decimals
          warn("the file grows while it is read; rows from here on were left out");
          return false;
        }
        --left;
        try {
          visitor.row(row);
        } catch (const std::invalid_argument& error) {
          pass.fail(error.what());
        }
        for (const std::string& oddity : oddities.of(row)) warn(oddity);
        return true;
      });
  if (!whole) warn("the last line is torn (no line end) and was left out");
}

}  // namespace runtime::mcap
