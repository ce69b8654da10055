/// @file
/// A new file that grows by whole pieces, whatever happens to the disk.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace runtime {

/// After construction nothing throws and nothing ends the process (including a file size limit, even with
/// SIGXFSZ at its default action). A piece that reaches the file in part is cut off again. One thread at a
/// time, except for problem().
class AppendFile {
 public:
  /// How to treat an existing file of the same name, or a link to anything.
  enum class Existing : std::uint8_t { kRefuse, kReplace };

  enum class Step : std::int32_t {
    kNone,
    kAppendWidth,
    kAppendUnfit,
    kAppendClosed,
    kInspect,
    kFoundDeleted,
    kFoundShortened,
    kWrite,
    kCutTornRow,
    kSync,
    kClose,
  };

  /// Setup: creates the file, locks it and writes `head`.
  /// @throws hal::SetupError naming path and cause.
  AppendFile(const std::filesystem::path& path, std::string_view head, Existing existing);
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;
  ~AppendFile() { close(); }

  bool is_open() const noexcept { return fd_ >= 0; }
  /// Another party has deleted or shortened the file: what was appended is gone.
  bool is_lost() const noexcept { return is_lost_; }

  /// Leaves exactly the complete pieces in the file, and checks that the file still exists: an unlinked file
  /// accepts writes without an error. False if that fails.
  bool restore() noexcept;

  /// Appends what `whole` returns of the bytes that reached the file, all of them without a failure. After
  /// restore(). Returns the number of these bytes.
  std::size_t append(std::span<const char> bytes,
                     std::size_t (*whole)(std::span<const char> reached)) noexcept;

  /// Waits until everything is on disk (fsync) and closes. Further calls do nothing.
  void close() noexcept;

  /// Keeps the first one.
  void note(Step step, int error_number) noexcept;
  /// Texts on the first failure, and that of close(), with the path; empty if there was none. Any thread.
  std::string problem() const;

 private:
  /// The text is made only on request, because that allocates. Aligned to its size; otherwise clang reads it
  /// through libatomic.
  struct alignas(8) Failure {
    Step step = Step::kNone;
    std::int32_t error_number = 0;
  };
  static_assert(std::atomic<Failure>::is_always_lock_free);

  static std::string in_words(Failure failure);

  const std::string path_;
  int fd_ = -1;
  bool is_lost_ = false;
  std::int64_t file_bytes_ = 0;  // complete pieces; more on disk is our own torn one
  std::atomic<Failure> first_failure_{Failure{}};
  std::atomic<Failure> close_failure_{Failure{}};
};

}  // namespace runtime
