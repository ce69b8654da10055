/// @file
/// Reads a recording (apps/FILE_FORMATS.md) and validates everything.
///
///     const runtime::ReadRecording read = runtime::read_recording("wheel-1.csv");
///     for (const std::string& warning : read.warnings) ...
///     fit(read.recording);
///
/// Rejected, each with file, line and advice, all of a file together: columns with a unit other than the
/// contract's (position_deg), a missing time_s, names that are duplicate or empty; rows of the wrong width,
/// decimal commas, non-finite numbers; time that repeats or decreases; files without rows or header.
/// Accepted: columns in any order, unknown columns (kept, with a warning), CRLF, a byte order mark, blanks
/// around numbers. A last line without its line end was torn by a crash or a full disk, and its last number
/// may lack digits: it is left out, with a warning.
///
/// A measurement may have no result, which is `nan` in its row. The header gives the reason and the columns:
///
///     # not_measured: first_step_rad,torque_command_Nm: wheel-3 never moved up to 0.3 N·m
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "identification/recording.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/recording/column_map.h"

namespace runtime {

/// More than an hour of all columns at 1 kHz. The file is held in memory, so a longer one is rejected.
inline constexpr std::uintmax_t kMaxRecordingBytes = std::uintmax_t{2} << 30;
inline constexpr std::size_t kMaxRecordingColumns = 1000;

/// The recording cannot be used. problems(): each "file:line: message", in the order of the lines, the first
/// kMaxProblems and then the number of the rest.
class RecordingError : public ConfigError {
 public:
  static constexpr std::size_t kMaxProblems = 10;
  using ConfigError::ConfigError;
};

struct ReadRecording {
  identification::Recording recording;
  static constexpr std::size_t kMaxWarnings = 1000;
  std::vector<std::string> warnings;  ///< like problems(), the first kMaxWarnings
  std::size_t first_row_line = 0;     ///< in the file; the other rows follow line by line
};

/// How to treat a row with a missing value for which the header gives a reason: reject it, or accept NaN. The
/// reason is reported in both cases.
enum class NotMeasured : std::uint8_t { kRefused, kTaken };

/// Whether the recording contract has this column.
bool is_known_column(std::string_view name);

/// Of a file in a directory: `.csv`, or `.mcap` without the same recording as `.csv` beside it.
bool is_recording(const std::filesystem::path& path);

struct ReadOptions {
  NotMeasured not_measured = NotMeasured::kRefused;
  /// Of an MCAP file with several joints: the one to read, such as wheel_1. Empty: every column of a
  /// recording of ours, the only joint in a file of others.
  std::string joint = {};
  /// A recording of ours with several joints needs a choice, too.
  bool one_drive = false;
  /// Of a table of another program: the columns to take. The separator may be a comma, a semicolon or a tab,
  /// and names may be in quotation marks. Columns that the map does not name are left out, with a warning.
  std::shared_ptr<const ColumnMap> columns = nullptr;
};

/// A table of another program that is not text.
struct SourceTable {
  std::vector<std::string> names;
  std::map<std::string, double, std::less<>> header{};          ///< values that hold for all rows, such as kp
  std::vector<std::pair<std::string, std::string>> comments{};  ///< of the recording
  /// The next row, a field for each name, valid until the next call; false after the last one.
  std::function<bool(std::vector<std::string_view>& fields)> next;
};

/// A file that ends in `.mcap` is read as MCAP: every column of ours, or a joint of the
/// sensor_msgs/JointState of others. Messages then count rows in place of lines, and damage has its byte
/// offset. Of a file that is still written, or whose program was killed, the rows that are there, with a
/// warning.
/// @throws RecordingError, also if the file cannot be read.
ReadRecording read_recording(const std::filesystem::path& path,
                             NotMeasured not_measured = NotMeasured::kRefused);
ReadRecording read_recording(const std::filesystem::path& path, const ReadOptions& options);
/// The same for an MCAP file in memory; `name` replaces the file name in messages.
ReadRecording parse_mcap_recording(std::string_view bytes, const std::string& name,
                                   const ReadOptions& options = {});
/// The same for a text in memory; `name` replaces the file name in messages.
ReadRecording parse_recording(std::string_view text, const std::string& name,
                              NotMeasured not_measured = NotMeasured::kRefused);
/// The same for a text of another program.
ReadRecording parse_recording(std::string_view text, const std::string& name, const ColumnMap& columns);
/// The same for a table that is not text. Messages count rows in place of lines.
ReadRecording parse_table(const SourceTable& table, const std::string& name, const ColumnMap& columns);

}  // namespace runtime
