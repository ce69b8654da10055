/// @file
/// A run of the base on disk: one recording per wheel and one of the base as a whole.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/common/recorder.h"
#include "apps/common/recording_directory.h"
#include "apps/common/recording_file.h"
#include "apps/youbotd/cycle_record.h"
#include "apps/youbotd/recording_state.h"
#include "apps/youbotd/way_report.h"
#include "control/workspace.h"

namespace youbotd {

/// Columns and values of the table that shows a whole cycle (base.csv, and the report after a fault).
std::vector<apps::RecordingFile::Column> cycle_columns();
void append_cycle(apps::RecordingFile& file, const CycleRecord& record);

/// Writes `wheel-1.csv` … `wheel-4.csv` (format and columns of the recording contract, with the filtered
/// velocity) and `base.csv` (poses, wrench, timing) into a directory, `config.toml`, the file that made the
/// run, and at the end `report.html`. A run that ends before its first cycle leaves none of them. What cannot
/// be written never stops the robot: it is counted and reported at the end.
class BaseRecording {
 public:
  struct Description {
    std::filesystem::path directory;  ///< created when missing
    apps::RecordingConfig config;
    std::string experiment;
    bool friction_compensation = false;  ///< as run, whatever the configuration file says
    std::chrono::nanoseconds period;
    control::Workspace workspace{};
  };
  /// Writing there would replace an earlier recording, or somebody's configuration.
  static bool holds_recording(const std::filesystem::path& directory);

  /// Setup. @throws hal::SetupError when not all files can be made, or their headers not written; nothing is
  /// left there then.
  explicit BaseRecording(const Description& description);

  /// Cycle: wait-free.
  void add(const CycleRecord& record) noexcept { recorder_.push(record); }
  /// Not for a real-time cycle: waits until add() has room, for loops faster than the disk.
  void wait_for_room() noexcept { recorder_.wait_for_room(); }

  /// Writes out what is pending and closes the files. Call before the results below.
  void close() noexcept;

  std::uint64_t cycles_recorded() const noexcept;  ///< in every file
  std::uint64_t cycles_lost() const noexcept;      ///< missing in at least one file
  /// Any time, also while it is written.
  RecordingState state() const;
  /// What went wrong, in words; empty when everything is on disk.
  std::vector<std::string> problems() const;

 private:
  using Files = std::vector<std::unique_ptr<apps::RecordingFile>>;
  Files open_files(const Description& description);
  void write(const CycleRecord& record);
  void flush();

  std::vector<std::string> setup_problems_;
  apps::NewRecording new_recording_;  // takes the files away unless there are rows
  Files files_;                       // four wheels, then the base
  WayReport way_;
  std::filesystem::path report_;
  std::string report_problem_;
  apps::Recorder<CycleRecord> recorder_;  // last: its thread uses what is above
};

}  // namespace youbotd
