#include "runtime/recording/recording_reader.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <system_error>

#include "runtime/mcap/mcap_file.h"
#include "runtime/mcap/recording_rows.h"
#include "runtime/recording/lines.h"

namespace runtime {
namespace {

struct KnownColumn {
  std::string_view quantity;
  std::string_view name;
};
/// Longer quantities first, so that velocity_command_deg_per_s does not match velocity.
constexpr auto kKnownColumns = std::to_array<KnownColumn>({{"velocity_command", "velocity_command_rad_per_s"},
                                                           {"position_command", "position_command_rad"},
                                                           {"torque_measured", "torque_measured_Nm"},
                                                           {"torque_command", "torque_command_Nm"},
                                                           {"torque_ci95", "torque_ci95_Nm"},
                                                           {"temperature", "temperature_C"},
                                                           {"servo_enabled", "servo_enabled"},
                                                           {"position", "position_rad"},
                                                           {"velocity", "velocity_rad_per_s"},
                                                           {"current", "current_A"},
                                                           {"time", "time_s"}});
/// Lower case; words of units in column names.
constexpr auto kColumnUnitWords = std::to_array<std::string_view>(
    {"s",   "ms",  "us",  "ns", "min",  "h",     "rad", "mrad",  "urad", "deg",     "rev",   "turns",
     "rpm", "per", "nm",  "n",  "mnm",  "knm",   "ncm", "m",     "a",    "ma",      "c",     "k",
     "f",   "kg",  "cm2", "g",  "ozin", "ticks", "inc", "count", "raw",  "percent", "counts"});

std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return lower;
}

bool is_unit(std::string_view words) {
  while (!words.empty()) {
    const std::size_t end = std::min(words.find('_'), words.size());
    const std::string word = lower_case(words.substr(0, end));
    if (std::find(kColumnUnitWords.begin(), kColumnUnitWords.end(), word) == kColumnUnitWords.end())
      return false;
    words.remove_prefix(std::min(end + 1, words.size()));
  }
  return true;
}

/// The contract's name for the quantity of `column`, which has another unit or none; otherwise empty.
std::string_view right_name(std::string_view column) {
  for (const KnownColumn& known : kKnownColumns) {
    if (!column.starts_with(known.quantity)) continue;
    const std::string_view rest = column.substr(known.quantity.size());
    if (rest.empty() || (rest.front() == '_' && is_unit(rest.substr(1)))) return known.name;
  }
  return {};
}

/// What other programs call a quantity, in lower case.
struct Alias {
  std::string_view alias;
  std::string_view name;
};
constexpr auto kAliases = std::to_array<Alias>({{"t", "time_s"},
                                                {"sec", "time_s"},
                                                {"secs", "time_s"},
                                                {"seconds", "time_s"},
                                                {"stamp", "time_s"},
                                                {"timestamp", "time_s"},
                                                {"elapsed", "time_s"},
                                                {"q", "position_rad"},
                                                {"pos", "position_rad"},
                                                {"theta", "position_rad"},
                                                {"angle", "position_rad"},
                                                {"qpos", "position_rad"},
                                                {"dq", "velocity_rad_per_s"},
                                                {"qd", "velocity_rad_per_s"},
                                                {"qdot", "velocity_rad_per_s"},
                                                {"qvel", "velocity_rad_per_s"},
                                                {"vel", "velocity_rad_per_s"},
                                                {"speed", "velocity_rad_per_s"},
                                                {"omega", "velocity_rad_per_s"},
                                                {"tau", "torque_measured_Nm"},
                                                {"torque", "torque_measured_Nm"},
                                                {"effort", "torque_measured_Nm"}});

/// The contract's name that an unknown `column` most likely stands for: its alias, with or without a unit.
std::string_view likely_name(std::string_view column) {
  const std::string lower = lower_case(column);
  for (const KnownColumn& known : kKnownColumns)
    if (lower == lower_case(known.name)) return known.name;
  if (const std::string_view right = right_name(lower); !right.empty()) return right;
  for (const auto& [alias, name] : kAliases) {
    if (!lower.starts_with(alias)) continue;
    const std::string_view rest = std::string_view(lower).substr(alias.size());
    if (rest.empty() || (rest.front() == '_' && is_unit(rest.substr(1)))) return name;
  }
  return {};
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

/// The part of a field that fits a message, whatever its bytes.
std::string quoted(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string result = "'";
  for (const char c : text.substr(0, kLongest))
    result += std::isprint(static_cast<unsigned char>(c)) ? c : '?';
  return result + (text.size() > kLongest ? "…'" : "'");
}

/// What stands between the names instead of a comma, for messages; empty if there is no such character.
std::string_view other_separator(std::string_view names) {
  const auto has = [](std::string_view text, char c) { return text.find(c) != text.npos; };
  if (has(names, ';')) return "';'";
  if (has(names, ',')) return {};
  if (has(names, '\t')) return "tabs";
  if (has(names, '|')) return "'|'";
  return has(trimmed(names), ' ') ? "blanks" : "";
}

/// Whether a comma follows a digit and precedes one, and no point does.
bool has_decimal_comma(std::string_view row) {
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  bool found = false;
  for (std::size_t i = 1; i + 1 < row.size(); ++i) {
    if (!is_digit(row[i - 1]) || !is_digit(row[i + 1])) continue;
    if (row[i] == '.') return false;
    found |= row[i] == ',';
  }
  return found;
}

std::string shortest(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

/// The whole of `text` as a number, not necessarily a finite one.
bool parse_number(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

/// Three digits, without an exponent where that is as short: a few rounded times show no more of a rate.
std::string rounded_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2e", value);
  return shortest(std::strtod(text.data(), nullptr));
}

/// At least this share of the rows has the time of the row before.
constexpr double kManyRepeats = 0.2;
constexpr std::size_t kMinRoundedSteps = 10;
/// Of a stated rate.
constexpr double kSameRate = 0.02;

/// Times with too few decimals for their rate.
struct RoundedTimes {
  double step_s = 0;    ///< they are rounded to
  double period_s = 0;  ///< of the rows, on average
  bool even = false;    ///< even rows lie within a step of all times
};

/// Whether rows `period_s` apart lie within a step of all times.
bool are_even(std::span<const double> time_s, double period_s, double step_s) {
  double lowest_s = 0;
  double highest_s = 0;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    const double off_s = time_s[i] - time_s.front() - static_cast<double>(i) * period_s;
    lowest_s = std::min(lowest_s, off_s);
    highest_s = std::max(highest_s, off_s);
  }
  return highest_s - lowest_s < step_s + period_s;
}

/// Nothing if too few times repeat, or if a row that repeats its time repeats everything.
std::optional<RoundedTimes> rounded_times(const identification::Recording& recording, std::size_t repeats) {
  const std::size_t rows = recording.rows();
  if (!recording.has("time_s") || static_cast<double>(repeats) < kManyRepeats * static_cast<double>(rows))
    return std::nullopt;
  const auto time_s = recording.column("time_s");
  std::vector<double> steps;
  bool copies = true;
  for (std::size_t i = 1; i < rows; ++i) {
    if (time_s[i] != time_s[i - 1]) {
      steps.push_back(time_s[i] - time_s[i - 1]);
      continue;
    }
    copies = copies && std::ranges::all_of(recording.columns, [i](const auto& column) {
               return column.values[i] == column.values[i - 1] ||
                      (std::isnan(column.values[i]) && std::isnan(column.values[i - 1]));
             });
  }
  if (copies || steps.size() < kMinRoundedSteps) return std::nullopt;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::ranges::nth_element(steps, middle);
  RoundedTimes result{.step_s = *middle};
  // The straight line of least squares, from the middle, so that seconds since 1970 keep their digits.
  const double centre = 0.5 * static_cast<double>(rows - 1);
  const double centre_s = time_s[rows / 2];
  double product = 0;
  double squares = 0;
  for (std::size_t i = 0; i < rows; ++i) {
    const double from_centre = static_cast<double>(i) - centre;
    product += from_centre * (time_s[i] - centre_s);
    squares += from_centre * from_centre;
  }
  result.period_s = product / squares;
  const double stated_s = 1 / recording.sample_rate_Hz;
  if (recording.sample_rate_Hz > 0 && std::abs(result.period_s / stated_s - 1) < kSameRate &&
      are_even(time_s, stated_s, result.step_s))
    result.period_s = stated_s;
  result.even = are_even(time_s, result.period_s, result.step_s);
  return result;
}

class Reader {
 public:
  Reader(Lines lines, const std::string& name, NotMeasured not_measured)
      : lines_(std::move(lines)), name_(name), not_measured_(not_measured) {}

  /// The same checks of an MCAP file. Rows are counted in place of lines.
  ReadRecording read_mcap(const std::function<mcap::ReadBytes()>& open, const ReadOptions& options) {
    titled_ = true;
    result_.first_row_line = 1;
    mcap::read_mcap_rows(open, name_, {.joint = options.joint, .one_drive = options.one_drive},
                         {.head = [this](const mcap::RecordingHead& head) { take_head(head); },
                          .row = [this](std::span<const double> row) { take_row(row); },
                          .warning = [this](const std::string& text) { add_warning(text); }});
    if (result_.recording.rows() == 0 && problems_.empty()) problem(0, "no rows; was anything recorded?");
    finish();
    return std::move(result_);
  }

  /// The same checks of a text of another program.
  ReadRecording read_mapped(const ColumnMap& map) {
    std::string_view line;
    bool whole = true;
    if (!read_comments(line, whole)) fail(line_, "no row of column names");
    if (!whole) fail(line_, "the file ends within the row of column names; nothing was recorded");
    char separator = map.separator;
    if (separator == 0)
      separator = find_separator(line, ';') != line.npos    ? ';'
                  : find_separator(line, '\t') != line.npos ? '\t'
                                                            : ',';
    std::vector<std::string_view> fields;
    split(line, separator, fields);
    const std::vector<std::string> names(fields.begin(), fields.end());
    std::string_view found = other_separator(line);
    if (found.empty() && separator != ',' && line.find(',') != line.npos) found = "','";
    if (names.size() == 1 && !found.empty())
      fail(line_, "columns are separated by " + std::string(found) + ", not by " +
                      (separator == '\t' ? "tabs" : "'" + std::string(1, separator) + "'") + "; " +
                      (map.separator != 0 && found != "'|'" && found != "blanks"
                           ? "correct or delete separator in " + map.name
                           : "export with ',', ';' or tabs between"));
    ColumnMapper mapper = begin_mapped(map, names, {});
    result_.first_row_line = line_ + 1;
    std::size_t blank = 0;  // lines, allowed only at the end
    while (next_line(line, whole)) {
      if (line.empty() && (whole || blank > 0)) {
        ++blank;
        continue;
      }
      if (blank > 0) problem(line_ - blank, "the line is empty; delete it");
      blank = 0;
      if (!whole) {
        warn(line_, "the last line is torn (no line end) and was left out");
        break;
      }
      split(line, separator, fields);
      take_mapped(mapper, fields, names.size());
    }
    return end_mapped();
  }

  ReadRecording read_table(const SourceTable& table, const ColumnMap& map) {
    for (const auto& [key, value] : table.comments) take_comment(key, value);
    ColumnMapper mapper = begin_mapped(map, table.names, table.header);
    result_.first_row_line = 1;
    std::vector<std::string_view> fields;
    while (table.next(fields)) {
      ++line_;
      take_mapped(mapper, fields, table.names.size());
    }
    return end_mapped();
  }

  ReadRecording read() {
    std::string_view line;
    bool whole = true;
    if (!read_comments(line, whole)) {
      problem(line_, "no row of column names; it follows the '#' lines: time_s,torque_command_Nm,…");
    } else if (read_header(line, whole)) {
      read_rows();
      if (result_.recording.rows() == 0 && problems_.empty())
        problem(line_, "no data rows; was anything recorded?");
    }
    finish();
    return std::move(result_);
  }

 private:
  bool next_line(std::string_view& line, bool& whole) {
    const bool there = lines_.next(line, whole);
    line_ += there ? 1 : 0;
    return there;
  }

  /// Up to the first line after them, which is in `line`; false if there is none.
  bool read_comments(std::string_view& line, bool& whole) {
    bool have_line = next_line(line, whole);
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    if (have_line && line.starts_with(kByteOrderMark)) line.remove_prefix(kByteOrderMark.size());
    if (!have_line || (line.empty() && !whole))
      fail(0, "the file is empty; a recording begins with '# youbot recording v1'");
    for (; have_line && (line.starts_with('#') || line.empty()); have_line = next_line(line, whole))
      read_comment(line);
    return have_line;
  }

  /// Outside of quotation marks, which begin at the start of a field: elsewhere they are inches.
  static std::size_t find_separator(std::string_view line, char separator) {
    bool in_quotes = false;
    bool at_start = true;  // of a field
    for (std::size_t i = 0; i < line.size(); ++i) {
      const char c = line[i];
      if (c == '"' && (in_quotes || at_start)) in_quotes = !in_quotes;
      if (c == separator && !in_quotes) return i;
      at_start = !in_quotes && (c == ',' || c == ';' || c == '\t' || (at_start && c == ' '));
    }
    // A quotation mark that is never closed is part of the text.
    return in_quotes ? line.find(separator) : line.npos;
  }

  /// Without the quotation marks that some programs put around names and numbers.
  static void split(std::string_view line, char separator, std::vector<std::string_view>& fields) {
    fields.clear();
    for (;;) {
      const std::size_t end = find_separator(line, separator);
      std::string_view field = trimmed(line.substr(0, end));
      if (field.size() >= 2 && field.front() == '"' && field.back() == '"')
        field = field.substr(1, field.size() - 2);
      fields.push_back(field);
      if (end == line.npos || fields.size() > kMaxRecordingColumns) return;
      line.remove_prefix(end + 1);
    }
  }

  ColumnMapper begin_mapped(const ColumnMap& map, const std::vector<std::string>& names,
                            const std::map<std::string, double, std::less<>>& header) {
    if (names.size() > kMaxRecordingColumns)
      fail(line_, "more than " + std::to_string(kMaxRecordingColumns) +
                      " columns; is this the row of column names?");
    ColumnMapper mapper(map, names, header);
    for (const std::string& text : mapper.problems()) problem(line_, text);
    if (!problems_.empty()) finish();
    std::string left_out;
    for (const std::string& name : mapper.left_out())
      (left_out += left_out.empty() ? "" : ", ") += quoted(std::string_view(name));
    if (!left_out.empty())
      warn(line_, "columns that " + map.name + " does not name were left out: " + left_out);
    if (result_.recording.rig.empty()) result_.recording.rig = map.rig;
    std::set<std::string_view> seen;
    for (const std::string& quantity : mapper.quantities()) {
      if (quantity == map.run) run_column_ = result_.recording.columns.size();
      add_column(quantity, seen);
    }
    return mapper;
  }

  void take_mapped(ColumnMapper& mapper, std::span<const std::string_view> fields, std::size_t columns) {
    if (fields.size() != columns) {
      problem(line_, std::to_string(fields.size()) + " values for " + std::to_string(columns) +
                         " columns; delete or repair this line");
      return;
    }
    std::string why;
    switch (mapper.convert(fields, row_, why)) {
      case ColumnMapper::Row::kLeftOut: ++rows_left_out_; return;
      case ColumnMapper::Row::kRefused: problem(line_, why); return;
      case ColumnMapper::Row::kTaken: break;
    }
    if (run_column_ < row_.size() && run_ != row_[run_column_]) {
      have_time_ = false;
      run_ = row_[run_column_];
    }
    if (!time_increases(row_)) return;
    for (std::size_t i = 0; i < row_.size(); ++i) result_.recording.columns[i].values.push_back(row_[i]);
  }

  ReadRecording end_mapped() {
    if (rows_left_out_ > 0)
      warn(0, std::to_string(rows_left_out_) + (rows_left_out_ == 1 ? " row was" : " rows were") +
                  " left out by the value of another column ([only], or a log's torque_enable)");
    if (result_.recording.rows() == 0 && problems_.empty())
      problem(line_,
              rows_left_out_ > 0
                  ? "the value of another column leaves out all rows ([only], or a log's torque_enable)"
                  : "no data rows; was anything recorded?");
    finish();
    return std::move(result_);
  }

  void read_comment(std::string_view line) {
    if (line.empty()) return;
    const std::string_view text = trimmed(line.substr(1));
    if (line_ == 1 && text.starts_with("youbot recording")) {
      titled_ = true;
      if (text != "youbot recording v1")
        problem(line_, quoted(text) + " is a format this program does not know; it reads v1");
      return;
    }
    const std::size_t colon = text.find(':');
    if (colon == text.npos) return;  // a free comment
    take_comment(std::string(trimmed(text.substr(0, colon))), trimmed(text.substr(colon + 1)));
  }

  void take_comment(const std::string& key, std::string_view value) {
    identification::Recording& recording = result_.recording;
    recording.comments.emplace_back(key, value);
    if (key == "rig") recording.rig = value;
    if (key == "experiment") recording.experiment = value;
    if (key == "not_measured") read_reason(value);
    if (key == "sample_rate_Hz" && !(parse_number(value, recording.sample_rate_Hz) &&
                                     std::isfinite(recording.sample_rate_Hz) && recording.sample_rate_Hz > 0))
      problem(line_, "sample_rate_Hz is " + quoted(value) + "; expected a positive number");
  }

  /// "COLUMN,COLUMN: reason"
  void read_reason(std::string_view text) {
    const std::size_t colon = text.find(':');
    if (colon == text.npos) return;
    const std::string reason(trimmed(text.substr(colon + 1)));
    for (std::string_view names = text.substr(0, colon);;) {
      const std::size_t comma = names.find(',');
      reasons_.emplace(trimmed(names.substr(0, comma)), reason);
      if (comma == names.npos) return;
      names.remove_prefix(comma + 1);
    }
  }

  bool read_header(std::string_view line, bool whole) {
    if (!titled_) warn(1, "does not begin with '# youbot recording v1'; read as if it did");
    double number = 0;
    if (parse_number(trimmed(line.substr(0, line.find_first_of(",;"))), number)) {
      problem(line_, "data begin here, but no row of column names came before; add one: time_s,…");
      return false;
    }
    if (!whole) {
      problem(line_, "the file ends within the row of column names; nothing was recorded");
      return false;
    }
    // Prose has blanks, too.
    if (const std::string_view separator = other_separator(line);
        !separator.empty() && (separator != "blanks" || titled_ ||
                               !right_name(trimmed(line).substr(0, trimmed(line).find(' '))).empty())) {
      refuse_separator(separator);
      return false;
    }
    if (const auto columns = 1 + std::count(line.begin(), line.end(), ',');
        static_cast<std::size_t>(columns) > kMaxRecordingColumns) {
      problem(line_, std::to_string(columns) + " columns, but at most " +
                         std::to_string(kMaxRecordingColumns) +
                         " are read; is this the row of column names?");
      return false;
    }
    std::set<std::string_view> seen;
    for (;;) {
      const std::size_t comma = line.find(',');
      add_column(trimmed(line.substr(0, comma)), seen);
      if (comma == line.npos) break;
      line.remove_prefix(comma + 1);
    }
    if (!titled_ && std::none_of(seen.begin(), seen.end(), [](std::string_view name) {
          return is_known_column(name) || !likely_name(name).empty();
        })) {
      problems_.clear();
      problem_count_ = 0;
      problem(line_,
              "this is not a recording: neither its first line nor any column name is known" + map_it(seen));
      return false;
    }
    check_names(seen);
    return true;
  }

  /// The names are in the current line; the row that follows shows the decimal point.
  void refuse_separator(std::string_view separator) {
    const std::size_t names_line = line_;
    std::string_view row;
    bool whole = true;
    const bool decimal_comma = next_line(row, whole) && has_decimal_comma(row);
    const bool is_mapped = separator == "';'" || separator == "tabs";
    problem(names_line,
            "columns are separated by " + std::string(separator) + ", not by commas" +
                (decimal_comma ? ", and the decimal point is a comma" : "") +
                "; export with ',' between and '.' as decimal point" +
                (is_mapped ? ", or read the table with a column map" +
                                 std::string(decimal_comma ? " that has decimal = \",\"" : "") +
                                 ": youbot-gap --columns MAP, or youbotctl convert TABLE OUT --columns MAP"
                           : ""));
  }

  /// The remedy for the names of another program's table.
  static std::string map_it(const std::set<std::string_view>& seen) {
    return seen.size() < 2 ? ""
                           : "; a column map says which column is what, in which unit: youbot-gap --columns "
                             "MAP, or youbotctl convert TABLE OUT --columns MAP";
  }

  /// Names that are unknown, and what they may stand for.
  void check_names(const std::set<std::string_view>& seen) {
    for (const identification::Recording::Column& column : result_.recording.columns) {
      const std::string_view name = column.name;
      if (name.empty() || is_known_column(name) || !right_name(name).empty()) continue;
      const std::string_view likely = likely_name(name);
      if (!likely.empty() && !seen.contains(likely) && lower_case(name) == lower_case(likely))
        problem(line_, "column " + quoted(name) + " must be " + std::string(likely) +
                           ", in this case: rename it, or name it in a column map: youbot-gap --columns MAP, "
                           "or youbotctl convert TABLE OUT --columns MAP");
      else if (likely == "time_s" && !seen.contains(likely))
        continue;  // reported as missing
      else
        warn(line_, "column " + quoted(name) + " is not part of the format; kept as it is" +
                        (likely.empty() || seen.contains(likely)
                             ? ""
                             : ". If it is " + std::string(likely) + ", rename it" + map_it(seen)));
    }
    require_time(seen);
  }

  void require_time(const std::set<std::string_view>& seen) {
    if (seen.contains("time_s")) return;
    std::string_view nearest;
    for (const std::string_view name : seen) {
      if (right_name(name) == "time_s" || lower_case(name) == "time_s") return;  // reported
      if (nearest.empty() && likely_name(name) == "time_s") nearest = name;
    }
    problem(line_, "column time_s is missing; every recording needs it" +
                       (nearest.empty()
                            ? map_it(seen)
                            : ". If it is " + quoted(nearest) + " and in seconds, rename it" + map_it(seen)));
  }

  void take_head(const mcap::RecordingHead& head) {
    for (const auto& [key, value] : head.comments) take_comment(key, value);
    std::set<std::string_view> seen;
    for (const auto& column : head.columns) add_column(column.name, seen);
    check_names(seen);
  }

  void take_row(std::span<const double> row) {
    std::vector<identification::Recording::Column>& columns = result_.recording.columns;
    ++line_;
    if (line_ * row.size() * sizeof(double) > kMaxRecordingBytes)
      fail(0, "has more than " + std::to_string(kMaxRecordingBytes) + " bytes of numbers; split it");
    missing_.clear();
    bool good = true;
    for (std::size_t i = 0; i < row.size(); ++i) good &= accept_value(shortest(row[i]), i, row[i]);
    good = good && time_increases(row);
    if (!tell_missing() || !good) return;
    for (std::size_t i = 0; i < row.size(); ++i) columns[i].values.push_back(row[i]);
  }

  void add_column(std::string_view name, std::set<std::string_view>& seen) {
    identification::Recording& recording = result_.recording;
    if (name.empty())
      problem(line_, "column " + std::to_string(recording.columns.size() + 1) + " has no name");
    else if (!seen.insert(name).second)
      problem(line_, "column " + quoted(name) + " is there twice; keep one");
    else if (name == "time_s")
      time_column_ = recording.columns.size();
    else if (!is_known_column(name)) {
      if (const std::string_view right = right_name(name); !right.empty())
        problem(line_, "column " + quoted(name) + " must be " + std::string(right) +
                           ": convert its values and rename it");
    }
    recording.columns.push_back({std::string(name), {}});
  }

  void read_rows() {
    std::vector<identification::Recording::Column>& columns = result_.recording.columns;
    std::vector<double> row(columns.size());
    result_.first_row_line = line_ + 1;
    for (auto& column : columns) column.values.reserve(lines_.left_bytes() / (8 * columns.size()) + 1);
    std::string_view line;
    bool whole = true;
    std::size_t blank = 0;  // lines, allowed only at the end
    while (next_line(line, whole)) {
      if (line.empty() && (whole || blank > 0)) {
        ++blank;
        continue;
      }
      for (line_ -= blank; blank > 0; --blank, ++line_) read_row({}, row);
      if (!whole) {
        warn(line_, "the last line is torn (no line end) and was left out");
        return;
      }
      if (!read_row(line, row)) continue;
      for (std::size_t i = 0; i < row.size(); ++i) columns[i].values.push_back(row[i]);
    }
  }

  bool read_row(std::string_view line, std::vector<double>& row) {
    missing_.clear();
    std::size_t fields = 0;
    bool good = true;
    for (std::string_view rest = line;; ++fields) {
      const std::size_t comma = rest.find(',');
      if (fields < row.size()) good &= read_field(rest.substr(0, comma), fields, row[fields]);
      if (comma == rest.npos) break;
      rest.remove_prefix(comma + 1);
    }
    ++fields;
    if (fields != row.size()) {
      const bool decimal_commas = fields == 2 * row.size() || line.find(';') != line.npos;
      problem(line_, std::to_string(fields) + " values for " + std::to_string(row.size()) + " columns; " +
                         (decimal_commas ? "are these decimal commas? Export with '.' as decimal point"
                                         : "delete or repair this line"));
      return false;
    }
    good = good && time_increases(row);
    return tell_missing() && good;
  }

  bool time_increases(std::span<const double> row) {
    if (time_column_ >= row.size()) return true;
    const double time_s = row[time_column_];
    const bool increases = !have_time_ || time_s > last_time_s_;
    // The whole file shows whether times that repeat are rounded; until then, the row stays.
    const bool repeats = have_time_ && time_s == last_time_s_;
    repeats_ += repeats ? 1 : 0;
    if (!increases)
      problem(line_, "time_s " + std::string(time_s == last_time_s_ ? "repeats " : "runs backward, from ") +
                         shortest(last_time_s_) + (time_s == last_time_s_ ? "" : " to " + shortest(time_s)) +
                         "; split the file there or delete the line");
    have_time_ = true;
    last_time_s_ = time_s;
    return increases || repeats;
  }

  /// True if the row may be accepted.
  bool tell_missing() {
    if (missing_.empty()) return true;
    const std::string& first = result_.recording.columns[missing_.front()].name;
    const std::string others =
        missing_.size() > 1 ? " and " + std::to_string(missing_.size() - 1) + " more were" : " was";
    const std::string message = first + others + " not measured: " + reasons_.at(first);
    if (not_measured_ == NotMeasured::kTaken)
      warn(line_, message);
    else
      problem(line_, message);
    return not_measured_ == NotMeasured::kTaken;
  }

  bool read_field(std::string_view field, std::size_t column, double& value) {
    if (!parse_number(field, value)) {
      field = trimmed(field);
      if (!parse_number(field, value)) return refuse_field(field, column);
    }
    return accept_value(field, column, value);
  }

  bool accept_value(std::string_view field, std::size_t column, double value) {
    if (std::isnan(value) && column != time_column_ &&
        reasons_.contains(result_.recording.columns[column].name)) {
      missing_.push_back(column);
      return true;
    }
    return std::isfinite(value) || refuse_field(field, column);
  }
  bool refuse_field(std::string_view field, std::size_t column) {
    const char* why = " is not a number";
    std::string lower(field.substr(0, 4));
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    if (lower.find("nan") != lower.npos || lower.find("inf") != lower.npos)
      why = " is not a finite number";
    else if (field.starts_with('#'))
      why = ": comments belong above the column names";
    problem(line_, result_.recording.columns[column].name + " " +
                       (field.empty() ? "is empty" : quoted(field) + why) +
                       "; delete the line or measure again");
    return false;
  }

  std::string located(std::size_t line, const std::string& message) const {
    return name_ + (line > 0 ? ":" + std::to_string(line) : "") + ": " + message;
  }
  void warn(std::size_t line, const std::string& message) { add_warning(located(line, message)); }
  void add_warning(const std::string& text) {
    if (warning_count_++ < ReadRecording::kMaxWarnings) result_.warnings.push_back(text);
  }
  void problem(std::size_t line, const std::string& message) {
    if (problem_count_++ < RecordingError::kMaxProblems) problems_.push_back(located(line, message));
  }
  [[noreturn]] void fail(std::size_t line, const std::string& message) {
    throw RecordingError({located(line, message)});
  }
  void count_more(std::vector<std::string>& lines, std::size_t count, const char* what) const {
    if (count > lines.size())
      lines.push_back(located(0, "and " + std::to_string(count - lines.size()) + " more " + what));
  }
  /// Replaces the problems of a file in which nothing but times repeat because they were rounded.
  void judge_repeats() {
    if (repeats_ == 0 || repeats_ != problem_count_) return;
    const std::optional<RoundedTimes> rounded = rounded_times(result_.recording, repeats_);
    if (!rounded) return;
    problems_.clear();
    problem_count_ = 0;
    const std::string found = "time_s is the same as in the row before in " + std::to_string(repeats_) +
                              " rows, because it is rounded to " + rounded_text(rounded->step_s) +
                              " s while rows are " + rounded_text(rounded->period_s) + " s apart";
    const double stated_Hz = result_.recording.sample_rate_Hz;
    const std::string rate = rounded_text(1 / rounded->period_s);
    if (!rounded->even)
      problem(0,
              found + "; the rows are not even, so that only an export with more decimals gives their times");
    else if (!(stated_Hz > 0))
      problem(0, found +
                     "; export it with more decimals or, if the rows come at an even rate, state it above "
                     "the column names of a CSV file: # sample_rate_Hz: " +
                     rate);
    else if (std::abs(stated_Hz * rounded->period_s - 1) > kSameRate)
      problem(0, found + ", which is " + rate + " Hz, not the stated sample_rate_Hz of " +
                     rounded_text(stated_Hz) + "; correct one of them");
    else {
      std::vector<double>& time_s = result_.recording.columns[time_column_].values;
      const double first_s = time_s.front();
      for (std::size_t i = 0; i < time_s.size(); ++i)
        time_s[i] = first_s + static_cast<double>(i) * rounded->period_s;
      warn(0, found + "; as sample_rate_Hz is stated, rows are taken as even, at " + rate + " Hz");
    }
  }

  void finish() {
    judge_repeats();
    count_more(result_.warnings, warning_count_, "warnings");
    if (problems_.empty()) return;
    count_more(problems_, problem_count_, "problems");
    throw RecordingError(std::move(problems_));
  }

  Lines lines_;
  const std::string& name_;
  NotMeasured not_measured_;
  std::map<std::string, std::string, std::less<>> reasons_;  // by column, why it is not measured
  std::vector<std::size_t> missing_;                         // columns of the current row
  std::vector<double> row_;                                  // of a mapped table
  std::size_t rows_left_out_ = 0;
  std::size_t line_ = 0;
  bool titled_ = false;
  std::size_t time_column_ = static_cast<std::size_t>(-1);
  std::size_t run_column_ = static_cast<std::size_t>(-1);
  std::optional<double> run_{};  // of the last row
  bool have_time_ = false;
  double last_time_s_ = 0;
  std::size_t repeats_ = 0;  // rows with the time of the row before
  ReadRecording result_;
  std::vector<std::string> problems_;
  std::size_t problem_count_ = 0;
  std::size_t warning_count_ = 0;
};

}  // namespace

bool is_known_column(std::string_view name) {
  return std::any_of(kKnownColumns.begin(), kKnownColumns.end(),
                     [name](const KnownColumn& known) { return known.name == name; });
}

bool is_recording(const std::filesystem::path& path) {
  if (path.extension() == ".csv") return true;
  std::error_code error;
  return path.extension() == ".mcap" &&
         !std::filesystem::exists(std::filesystem::path(path).replace_extension(".csv"), error);
}

ReadRecording parse_recording(std::string_view text, const std::string& name, NotMeasured not_measured) {
  return Reader(Lines(text), name, not_measured).read();
}

ReadRecording parse_recording(std::string_view text, const std::string& name, const ColumnMap& columns) {
  return Reader(Lines(text), name, NotMeasured::kRefused).read_mapped(columns);
}

ReadRecording parse_table(const SourceTable& table, const std::string& name, const ColumnMap& columns) {
  return Reader(Lines(""), name, NotMeasured::kRefused).read_table(table, columns);
}

ReadRecording parse_mcap_recording(std::string_view bytes, const std::string& name,
                                   const ReadOptions& options) {
  try {
    return Reader(Lines(""), name, options.not_measured)
        .read_mcap([bytes] { return mcap::read_from(bytes); }, options);
  } catch (const RecordingError&) {
    throw;
  } catch (const ConfigError& error) {
    throw RecordingError(error.problems());
  }
}

ReadRecording read_recording(const std::filesystem::path& path, NotMeasured not_measured) {
  return read_recording(path, ReadOptions{.not_measured = not_measured});
}

ReadRecording read_recording(const std::filesystem::path& path, const ReadOptions& options) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error))
    throw RecordingError({path.string() + ": is a directory; give the files in it"});
  // A pipe or a device may never end, and reading it may not even begin.
  if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error) && !error)
    throw RecordingError({path.string() + ": is not a regular file; write the recording to one"});
  if (const std::uintmax_t bytes = std::filesystem::file_size(path, error);
      !error && bytes > kMaxRecordingBytes)
    throw RecordingError({path.string() + ": has " + std::to_string(bytes) + " bytes, but at most " +
                          std::to_string(kMaxRecordingBytes) + " are read; split it"});
  if (options.columns && path.extension() == ".mcap")
    throw RecordingError(
        {path.string() + ": a column map is for tables of text and logs of bam; leave it out"});
  try {
    if (path.extension() == ".mcap")
      return Reader(Lines(""), path.string(), options.not_measured)
          .read_mcap([&path] { return mcap::read_file(path); }, options);
    const RegularFile file(path);
    const std::string name = path.string();
    Reader reader(Lines(file, kMaxRecordingBytes), name, options.not_measured);
    return options.columns ? reader.read_mapped(*options.columns) : reader.read();
  } catch (const RecordingError&) {
    throw;
  } catch (const ConfigError& named) {  // its problems name the file
    throw RecordingError(named.problems());
  } catch (const std::runtime_error& why) {
    throw RecordingError({path.string() + ": " + why.what()});
  }
}

}  // namespace runtime
