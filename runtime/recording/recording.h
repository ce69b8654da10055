/// @file
/// Records of a cycle on disk: one or more files, written by their own thread.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "runtime/recording/record_rows.h"
#include "runtime/recording/recorder.h"
#include "runtime/recording/recording_file.h"

namespace runtime {

/// A write failure never stops the robot: it is counted and reported at the end.
///
///     Recording<CycleRecord> recording(std::move(tables), [&](const CycleRecord&) { made.keep(); });
///     ... recording.add(record), once a cycle ...
///     recording.close();
template <typename Record>
class Recording {
 public:
  /// A file, and the function that writes a record to it.
  struct Table {
    std::unique_ptr<RecordingFile> file;
    std::function<void(RecordingFile&, const Record&)> append = append_record<Record>;
  };

  /// Setup. `also` gets each record after it was written, on the writer's thread.
  /// @throws hal::SetupError as Recorder.
  Recording(std::vector<Table> tables, std::function<void(const Record&)> also)
      : tables_(std::move(tables)),
        recorder_(
            kRingCapacity,
            [this, also = std::move(also)](const Record& record) {
              for (const Table& table : tables_) table.append(*table.file, record);
              also(record);
            },
            [this] {
              for (const Table& table : tables_) table.file->flush();
            }) {}

  /// Cycle: wait-free.
  void add(const Record& record) noexcept { recorder_.push(record); }
  /// Not for a real-time cycle: waits until add() has room, for loops faster than the disk.
  void wait_for_room() noexcept { recorder_.wait_for_room(); }

  /// Writes what is pending and closes the files. Call before the counts below.
  void close() noexcept {
    recorder_.stop();
    for (const Table& table : tables_) table.file->close();
  }

  std::uint64_t cycles_added() const noexcept { return recorder_.statistics().pushed; }
  /// In every file.
  std::uint64_t cycles_recorded() const noexcept {
    std::uint64_t least = cycles_added();
    for (const Table& table : tables_) least = std::min(least, table.file->rows_written());
    return least;
  }
  /// Missing in at least one file.
  std::uint64_t cycles_lost() const noexcept {
    const RecorderStatistics statistics = recorder_.statistics();
    return statistics.pushed + statistics.dropped - cycles_recorded();
  }
  /// The same during writing: rows that wait for their flush do not count as lost. Any thread.
  std::uint64_t cycles_lost_so_far() const noexcept {
    std::uint64_t most = 0;
    for (const Table& table : tables_) most = std::max(most, table.file->rows_lost());
    return recorder_.statistics().dropped + most;
  }
  /// Texts on what went wrong; empty if everything is on disk. Any thread except the cycle's.
  std::vector<std::string> problems() const {
    std::vector<std::string> problems;
    for (const Table& table : tables_)
      if (std::string error = table.file->error(); !error.empty()) problems.push_back(std::move(error));
    for (std::string& problem : recorder_.problems()) problems.push_back(std::move(problem));
    return problems;
  }

 private:
  /// 16 s at 1 kHz: longer than a disk stalls.
  static constexpr std::size_t kRingCapacity = 16384;

  std::vector<Table> tables_;
  Recorder<Record> recorder_;  // last: its thread uses the tables
};

}  // namespace runtime
