/// @file
/// One recording on disk, readable at every moment, whatever happens to the disk.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runtime/recording/append_file.h"

namespace runtime {

class RowFormat;

/// Writes a recording: comments, column names, then rows of numbers. A path that ends in `.mcap` becomes an
/// MCAP file with ROS 2 messages, any other one CSV text (apps/FILE_FORMATS.md).
///
///     RecordingFile file("wheel.csv", {{"rig", "wheel-1"}}, {{"time_s", 6}, {"position_rad"}});
///     file.append_row(std::array{0.001, 0.25});
///     file.close();
///     if (const std::string problem = file.error(); !problem.empty()) { ...say it... }
///
/// After construction nothing throws and nothing ends the process (including a file size limit, even with
/// SIGXFSZ at its default action). The file holds the header and complete rows only (complete chunks, as
/// MCAP): if a write fails half-way, the torn row is cut off again. Rows that did not get into the file are
/// counted and not kept; the next flush tries again, so a recording resumes, with a gap in its time column,
/// when space is available again.
///
/// Not for the cycle: a write blocks as long as the disk does. append_row(), flush() and close() belong to
/// one thread at a time; rows_written(), rows_lost() and error() may be called from any.
class RecordingFile {
 public:
  struct Comment {
    std::string key;
    std::string value;
  };
  struct Column {
    std::string name;                            ///< with its unit, such as "torque_measured_Nm"
    std::optional<int> decimals = std::nullopt;  ///< empty: the shortest text that reads back equal
  };
  /// A text that an MCAP file holds beside the rows, such as the configuration. CSV has no place for it.
  struct Attachment {
    std::string name;
    std::string text;
  };
  static constexpr int kMaxDecimals = 17;

  using Existing = AppendFile::Existing;

  /// Setup: creates the file and writes the header. Both lists keep their order; the caller chooses the
  /// columns.
  /// @throws hal::SetupError naming path and cause if the file already exists, cannot be created, is not a
  /// regular one, is already being recorded (it is locked, so two daemons cannot spoil each other's file) or
  /// has no room for the header; std::invalid_argument if a key, value or column name would break the format,
  /// if a column is given twice, or if decimals are outside [0, kMaxDecimals]; as MCAP also without a column
  /// `time_s`.
  RecordingFile(const std::filesystem::path& path, const std::vector<Comment>& comments,
                const std::vector<Column>& columns, Existing existing = Existing::kRefuse,
                const std::vector<Attachment>& attachments = {});
  RecordingFile(const RecordingFile&) = delete;
  RecordingFile& operator=(const RecordingFile&) = delete;
  ~RecordingFile();

  /// Takes one row, in column order, into memory. Flushes first if the memory is full. As CSV it allocates
  /// nothing and writes NaN as `nan`. A row of the wrong width, or after close(), counts as lost; as MCAP
  /// also one whose time is no number.
  void append_row(std::span<const double> values) noexcept;

  /// Passes the rows in memory to the operating system; they then survive a crash of this process but not a
  /// power cut.
  void flush() noexcept;

  /// Flushes, completes the file, waits until everything is on disk (fsync) and closes. Further calls do
  /// nothing.
  void close() noexcept;

  /// Rows in the file. Falls back to 0 if another party has deleted or shortened the file.
  std::uint64_t rows_written() const noexcept { return rows_written_.load(std::memory_order_relaxed); }
  /// Rows passed in that are not, or no longer, in the file.
  std::uint64_t rows_lost() const noexcept { return rows_lost_.load(std::memory_order_relaxed); }
  /// Text on the first failure, and that of close(), with path and counts; empty if there was none. It stays
  /// after a recovery, because the rows stay lost.
  std::string error() const;

 private:
  bool restore() noexcept;
  void lose_row(AppendFile::Step step) noexcept;

  std::size_t width_;
  std::unique_ptr<RowFormat> format_;
  AppendFile file_;
  std::atomic<std::uint64_t> rows_written_{0};
  std::atomic<std::uint64_t> rows_lost_{0};
};

}  // namespace runtime
