/// @file
/// A run of teleoperation on disk: teleoperation.csv, the configuration that made it, and report.html.
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
#include "apps/youbotd/recording_state.h"
#include "apps/youbotd/teleop_record.h"
#include "apps/youbotd/way_report.h"
#include "control/workspace.h"

namespace youbotd {

/// Columns and values of a record as a row.
std::vector<apps::RecordingFile::Column> teleop_columns();
void append_teleop(apps::RecordingFile& file, const TeleopRecord& record);

/// What cannot be written never stops the robot: it is counted and reported at the end.
class TeleopRecording {
 public:
  /// Writing there would replace an earlier recording, or somebody's configuration.
  static bool holds_recording(const std::filesystem::path& directory);

  /// Setup. @throws hal::SetupError when the file cannot be made, or its header not written; nothing is left
  /// there then. `simulated`: the truth is known.
  TeleopRecording(const std::filesystem::path& directory, const apps::RecordingConfig& config,
                  std::chrono::nanoseconds period, bool simulated, const control::Workspace& workspace);

  /// Cycle: wait-free.
  void add(const TeleopRecord& record) noexcept { recorder_.push(record); }
  /// Not for a real-time cycle: waits until add() has room.
  void wait_for_room() noexcept { recorder_.wait_for_room(); }
  /// Writes out what is pending and closes the file. Call before the results below.
  void close() noexcept;

  std::uint64_t cycles_recorded() const noexcept;
  std::uint64_t cycles_lost() const noexcept;
  /// Any time, also while it is written.
  RecordingState state() const;
  std::vector<std::string> problems() const;

 private:
  void write(const TeleopRecord& record);
  std::unique_ptr<apps::RecordingFile> open(std::chrono::nanoseconds period, bool simulated,
                                            const control::Workspace& workspace);

  std::vector<std::string> setup_problems_;
  apps::NewRecording new_recording_;  // takes the file away unless all is ready
  std::unique_ptr<apps::RecordingFile> file_;
  WayReport way_;
  std::filesystem::path report_;
  std::string report_problem_;
  apps::Recorder<TeleopRecord> recorder_;  // last: its thread uses what is above
};

}  // namespace youbotd
