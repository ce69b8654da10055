/// @file
/// A run on disk: its tables and its configuration.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "operation/recording_state.h"
#include "runtime/recording/record_rows.h"
#include "runtime/recording/recording.h"
#include "runtime/recording/recording_directory.h"

namespace operation {

/// A row of teleoperation as CSV has 750 bytes, the five rows of a base together 550. As MCAP, a row of
/// teleoperation takes 90 bytes in virtual time and 105 in real time; noise of a robot adds to that.
constexpr double bytes_per_cycle(runtime::RecordingFormat format) {
  return format == runtime::RecordingFormat::kCsv ? 800 : 160;
}
/// For half a minute at 1 kHz: with less room a run is rejected.
constexpr double min_room_bytes(runtime::RecordingFormat format) { return 30e3 * bytes_per_cycle(format); }

/// Whether a recording into this directory would replace an earlier recording, or a user's configuration.
bool holds_recording(const std::filesystem::path& directory);
/// Leaves nothing there. @throws std::invalid_argument if a recording there would replace something,
/// hal::SetupError if it cannot work.
void check_record_directory(const std::filesystem::path& directory, runtime::RecordingFormat format);

/// Into a directory that is created if it is missing. A run that ends before its first cycle leaves nothing.
/// A write failure never stops the robot: it is counted and reported at the end.
template <typename Record>
class RunRecording {
 public:
  struct Table {
    std::string file;  ///< without extension
    std::string rig = file;
    std::vector<runtime::RecordingFile::Column> columns = runtime::columns_of(Record{});
    std::function<void(runtime::RecordingFile&, const Record&)> append = runtime::append_record<Record>;
  };
  struct Description {
    std::filesystem::path directory;
    runtime::RecordingConfig config;
    std::vector<runtime::RecordingFile::Comment> comments;  ///< of each table, after its rig
    std::vector<Table> tables;
    std::function<void(const Record&)> also{};  ///< gets each record on the writer's thread; may be empty
  };

  /// Setup. @throws hal::SetupError if not all files can be created and their headers written; nothing is
  /// left there then.
  explicit RunRecording(Description description)
      : new_recording_(description.directory, description.config, setup_problems_),
        recording_(open(description), [this, also = std::move(description.also)](const Record& record) {
          new_recording_.keep();
          if (also) also(record);
        }) {}

  /// Cycle: wait-free.
  void add(const Record& record) noexcept { recording_.add(record); }
  /// Not for a real-time cycle: waits until add() has room, for loops faster than the disk.
  void wait_for_room() noexcept { recording_.wait_for_room(); }

  /// Writes what is pending and closes the files. Call before the results below.
  void close() noexcept { recording_.close(); }

  std::uint64_t cycles_recorded() const noexcept { return recording_.cycles_recorded(); }
  std::uint64_t cycles_lost() const noexcept { return recording_.cycles_lost(); }
  /// Any time, also during writing.
  RecordingState state() const {
    return {.cycles_lost = recording_.cycles_lost_so_far(), .problems = problems()};
  }
  /// Texts on what went wrong; empty if everything is on disk.
  std::vector<std::string> problems() const {
    std::vector<std::string> problems = setup_problems_;
    for (std::string& problem : recording_.problems()) problems.push_back(std::move(problem));
    return problems;
  }

 private:
  std::vector<typename runtime::Recording<Record>::Table> open(const Description& description) {
    std::vector<typename runtime::Recording<Record>::Table> opened;
    for (const Table& table : description.tables) {
      std::vector<runtime::RecordingFile::Comment> comments{{"rig", table.rig}};
      comments.insert(comments.end(), description.comments.begin(), description.comments.end());
      opened.push_back({new_recording_.open(table.file, comments, table.columns), table.append});
    }
    return opened;
  }

  std::vector<std::string> setup_problems_;
  runtime::NewRecording new_recording_;   // removes the files unless there are rows
  runtime::Recording<Record> recording_;  // last: its thread uses what is above
};

}  // namespace operation
