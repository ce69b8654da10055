/// @file
/// One recording on disk, readable at every moment, whatever happens to the disk.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace runtime {

/// Writes the recording format: `# youbot recording v1`, `# key: value` lines, one row of column
/// names, then rows of numbers.
///
///     RecordingFile file("wheel.csv", {{"rig", "wheel-1"}}, {{"time_s", 6}, {"position_rad"}});
///     file.append_row(std::array{0.001, 0.25});
///     file.close();
///     if (const std::string problem = file.error(); !problem.empty()) { ...say it... }
///
/// After construction nothing throws and nothing ends the process (including a file size limit, even with
/// SIGXFSZ at its default action). The file holds the header and complete rows only: if a write fails
/// half-way, the torn row is cut off again. Rows that did not get into the file are counted and not kept; the
/// next flush tries again, so a recording resumes, with a gap in its time column, when space is available
/// again.
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
  static constexpr int kMaxDecimals = 17;

  /// How to treat an existing file of the same name, or a link to anything.
  enum class Existing : std::uint8_t { kRefuse, kReplace };

  /// Setup: creates the file and writes the header. Both lists keep their order; the caller chooses the
  /// columns.
  /// @throws hal::SetupError naming path and cause if the file already exists, cannot be created, is not a
  /// regular one, is already being recorded (it is locked, so two daemons cannot spoil each other's file) or
  /// has no room for the header; std::invalid_argument if a key, value or column name would break the format,
  /// if a column is given twice, or if decimals are outside [0, kMaxDecimals].
  RecordingFile(const std::filesystem::path& path, const std::vector<Comment>& comments,
                const std::vector<Column>& columns, Existing existing = Existing::kRefuse);
  RecordingFile(const RecordingFile&) = delete;
  RecordingFile& operator=(const RecordingFile&) = delete;
  ~RecordingFile() { close(); }

  /// Formats one row, in column order, into memory; allocates nothing. Flushes first when the memory
  /// Formats one row, in column order, into memory; allocates nothing. Flushes first if the memory is full.
  /// NaN is written as `nan`. A row of the wrong width, or after close(), counts as lost.
  void append_row(std::span<const double> values) noexcept;

  /// Passes the rows in memory to the operating system; they then survive a crash of this process but not a
  /// power cut.
  void flush() noexcept;

  /// Flushes, waits until everything is on disk (fsync) and closes. Further calls do nothing.
  void close() noexcept;

  /// Rows in the file. Falls back to 0 if another party has deleted or shortened the file.
  std::uint64_t rows_written() const noexcept { return rows_written_.load(std::memory_order_relaxed); }
  /// Rows passed in that are not, or no longer, in the file.
  std::uint64_t rows_lost() const noexcept { return rows_lost_.load(std::memory_order_relaxed); }
  /// Text on the first failure, and that of close(), with path and counts; empty if there was none. It stays
  /// after a recovery, because the rows stay lost.
  std::string error() const;

 private:
  enum class Step : std::int32_t {
    kNone,
    kAppendWidth,
    kAppendClosed,
    kInspect,
    kFoundDeleted,
    kFoundShortened,
    kWrite,
    kCutTornRow,
    kSync,
    kClose,
  };
  /// The text is made only on request, because that allocates. Aligned to its size; otherwise clang reads it
  /// through libatomic.
  struct alignas(8) Failure {
    Step step = Step::kNone;
    std::int32_t error_number = 0;
  };
  static_assert(std::atomic<Failure>::is_always_lock_free);

  static std::string in_words(Failure failure);
  void create(const std::string& header, Existing existing);
  bool restore_last_whole_row() noexcept;
  void lose_row(Step step) noexcept;
  void note(Step step, int error_number) noexcept;

  const std::string path_;
  std::vector<std::optional<int>> decimals_;  // by column
  std::size_t longest_row_bytes_ = 0;
  std::vector<char> buffer_;  // complete rows only
  std::size_t buffered_bytes_ = 0;
  std::uint64_t buffered_rows_ = 0;
  int fd_ = -1;
  std::int64_t file_bytes_ = 0;  // header and complete rows; more on disk is our own torn row
  std::atomic<std::uint64_t> rows_written_{0};
  std::atomic<std::uint64_t> rows_lost_{0};
  std::atomic<Failure> first_failure_{Failure{}};
  std::atomic<Failure> close_failure_{Failure{}};
};

}  // namespace runtime
