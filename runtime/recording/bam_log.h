/// @file
/// Logs of bam (github.com/Rhoban/bam), JSON as its record.py and process.py write it: an object with the
/// values of the run (`kp`, `vin`, `mass`, `length`, `arm_mass` or `arm-mass`, `motor`, `trajectory`, …) and
/// `entries`, a list of objects: `timestamp` [s], `position`, `goal_position` [rad], `speed` [rad/s], `load`,
/// `input_volts` [V], `temp` [°C], `torque_enable`; of an eRob also `torque_demand` and `control`.
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "runtime/recording/recording_reader.h"

namespace runtime {

/// A minute at 250 Hz takes 4 MB. The file is held in memory.
inline constexpr std::size_t kMaxBamLog_bytes = std::size_t{64} << 20;

/// Without a column map: time, position and its set-point, temperature if there is one; rows with the torque
/// switched off are left out, with a warning. A torque needs a column map, which names keys of the entries as
/// columns: the servo's constants are not in the log. The run's values become comments of the recording.
/// @throws RecordingError naming the entry, the key and what to do. Messages count entries in place of lines.
ReadRecording parse_bam_log(std::string_view text, const std::string& name, const ColumnMap* columns);

/// A `.json` file is read as a log of bam; any other one as read_recording() does.
/// @throws RecordingError, also if the file cannot be read.
ReadRecording read_recording_or_log(const std::filesystem::path& path, const ReadOptions& options);

}  // namespace runtime
