/// @file
/// Reads a recording (apps/FILE_FORMATS.md) and believes nothing about it.
///
///     const runtime::ReadRecording read = runtime::read_recording("wheel-1.csv");
///     for (const std::string& warning : read.warnings) ...
///     fit(read.recording);
///
/// Refused, each with file, line and what to do, all of a file together: columns with a unit other than the
/// contract's (position_deg), without time_s, named twice or not at all; rows of the wrong width, decimal
/// commas, what is not a finite number; time that repeats or runs backward; files without rows or header.
/// Taken: columns in any order, other columns (kept, with a warning), CRLF, a byte order mark, blanks round
/// numbers. A last line without its end was torn by a crash or a full disk, and its last number may lack
/// digits: it is left out, with a warning.
///
/// A measurement may have no result, which is `nan` in its row. The header says why, and for which columns:
///
///     # not_measured: first_step_rad,torque_command_Nm: wheel-3 never moved up to 0.3 N·m
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "identification/recording.h"
#include "runtime/configuration/toml_reader.h"

namespace runtime {

/// An hour of all columns at 1 kHz takes less. It is held in memory, so a longer file is refused.
inline constexpr std::uintmax_t kMaxRecordingBytes = std::uintmax_t{2} << 30;
inline constexpr std::size_t kMaxRecordingColumns = 1000;

/// The recording cannot be used. problems(): each "file:line: message", in the order of the lines, the first
/// kMaxProblems and then how many more there are.
class RecordingError : public ConfigError {
 public:
  static constexpr std::size_t kMaxProblems = 10;
  using ConfigError::ConfigError;
};

struct ReadRecording {
  identification::Recording recording;
  static constexpr std::size_t kMaxWarnings = 1000;
  std::vector<std::string> warnings;  ///< as problems(), the first kMaxWarnings
  std::size_t first_row_line = 0;     ///< of the file; the other rows follow line by line
};

/// What becomes of a row that lacks something for which the header has a reason: it is refused, or taken as
/// NaN. The reason is told either way.
enum class NotMeasured : std::uint8_t { kRefused, kTaken };

/// @throws RecordingError, also when the file cannot be read.
ReadRecording read_recording(const std::filesystem::path& path,
                             NotMeasured not_measured = NotMeasured::kRefused);
/// The same for a text in memory; `name` stands for the file in messages.
ReadRecording parse_recording(std::string_view text, const std::string& name,
                              NotMeasured not_measured = NotMeasured::kRefused);

}  // namespace runtime
