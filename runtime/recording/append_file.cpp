#include "runtime/recording/append_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "drivers/uninterrupted.h"
#include "hal/setup_error.h"
#include "runtime/recording/file_size_signal.h"

namespace runtime {
namespace {

struct WriteResult {
  std::size_t bytes = 0;  ///< that reached the file, also if the rest failed
  int error_number = 0;
};

WriteResult write_all(int fd, std::span<const char> text) noexcept {
  const FileSizeSignalHeldBack held_back;
  WriteResult result;
  while (result.bytes < text.size()) {
    const auto rest = text.subspan(result.bytes);
    const ssize_t count = drivers::uninterrupted([&] { return ::write(fd, rest.data(), rest.size()); });
    if (count <= 0) {
      // No file system should return 0; a retry might never end.
      result.error_number = count < 0 ? errno : ENOSPC;
      break;
    }
    result.bytes += static_cast<std::size_t>(count);
  }
  return result;
}

bool truncate_to(int fd, std::int64_t bytes) noexcept {
  return drivers::uninterrupted([&] { return ::ftruncate(fd, bytes); }) == 0;
}

}  // namespace

AppendFile::AppendFile(const std::filesystem::path& path, std::string_view head, Existing existing)
    : path_(path.string()) {
  bool is_ours = false;  // created or emptied here: without a complete header it is not a recording
  const auto refuse = [this, &is_ours](const char* problem, int error_number, const char* hint) {
    if (fd_ >= 0) ::close(fd_);
    if (is_ours) ::unlink(path_.c_str());
    std::string step = problem;
    if (error_number != 0) step += ": " + std::generic_category().message(error_number);
    throw hal::SetupError("recording " + path_, step, hint);
  };
  // O_APPEND: after a torn piece is cut off, the next write goes to the new end and leaves no hole. No
  // O_TRUNC: the file may be another daemon's; only the lock shows that.
  const auto open = [this](int more) {
    return drivers::uninterrupted(
        [&] { return ::open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | more, 0644); });
  };
  fd_ = open(O_EXCL | O_NOFOLLOW);
  is_ours = fd_ >= 0;
  struct stat status {};
  const auto refuse_special = [&] {
    if (!S_ISREG(status.st_mode))
      refuse("not a regular file", 0, "a torn row could not be cut off it; choose another path");
  };
  if (fd_ < 0 && errno == EEXIST) {
    // Before it is opened: a device may react to that.
    if (::stat(path_.c_str(), &status) == 0) refuse_special();
    if (existing == Existing::kRefuse)
      refuse("cannot create the file", EEXIST, "it is not replaced; choose another path");
    fd_ = open(O_NONBLOCK);  // a pipe in its place has no reader
  }
  if (fd_ < 0) refuse("cannot create the file", errno, "the folder must exist and be writable");

  if (::fstat(fd_, &status) != 0) refuse("cannot inspect the file", errno, "choose another folder");
  refuse_special();
  // File systems without locks (some network ones) still record; only a lock held elsewhere prevents it.
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    refuse("another recording is being written to the file", 0, "stop that one or choose another path");
  }
  if (!truncate_to(fd_, 0)) refuse("cannot empty the file", errno, "choose another path");
  is_ours = true;
  if (const auto written = write_all(fd_, head); written.error_number != 0)
    refuse("cannot write the header", written.error_number, "make room or choose another folder");
  file_bytes_ = static_cast<std::int64_t>(head.size());
}

std::size_t AppendFile::append(std::span<const char> bytes,
                               std::size_t (*whole)(std::span<const char> reached)) noexcept {
  const auto [count, error_number] = write_all(fd_, bytes);
  const std::size_t kept = error_number == 0 ? count : whole(bytes.first(count));
  file_bytes_ += static_cast<std::int64_t>(kept);
  if (error_number != 0) {
    note(Step::kWrite, error_number);
    if (kept != count && !truncate_to(fd_, file_bytes_)) {
      note(Step::kCutTornRow, errno);  // the next restore() tries again
    }
  }
  return kept;
}

void AppendFile::close() noexcept {
  if (fd_ < 0) return;
  restore();
  // A disk that failed behind the page cache reports it here, and only once.
  if (drivers::uninterrupted([this] { return ::fsync(fd_); }) != 0) {
    close_failure_.store({Step::kSync, errno}, std::memory_order_relaxed);
  }
  // Not repeated after EINTR: Linux has already closed the descriptor, and nothing is lost.
  if (::close(fd_) != 0 && errno != EINTR &&
      close_failure_.load(std::memory_order_relaxed).step == Step::kNone) {
    close_failure_.store({Step::kClose, errno}, std::memory_order_relaxed);
  }
  fd_ = -1;
}

bool AppendFile::restore() noexcept {
  struct stat status {};
  if (::fstat(fd_, &status) != 0) {
    note(Step::kInspect, errno);
    return false;
  }
  if (status.st_nlink == 0 || status.st_size < file_bytes_) {
    note(status.st_nlink == 0 ? Step::kFoundDeleted : Step::kFoundShortened, 0);
    is_lost_ = true;
    return false;
  }
  if (status.st_size > file_bytes_ && !truncate_to(fd_, file_bytes_)) {
    note(Step::kCutTornRow, errno);
    return false;
  }
  return true;
}

void AppendFile::note(Step step, int error_number) noexcept {
  if (first_failure_.load(std::memory_order_relaxed).step == Step::kNone) {
    first_failure_.store({step, error_number}, std::memory_order_relaxed);
  }
}

std::string AppendFile::problem() const {
  const Failure first = first_failure_.load(std::memory_order_relaxed);
  const Failure at_close = close_failure_.load(std::memory_order_relaxed);
  if (first.step == Step::kNone && at_close.step == Step::kNone) return "";
  std::string words = "recording " + path_ + ": ";
  if (first.step != Step::kNone) words += in_words(first) + "; ";
  if (at_close.step != Step::kNone) words += in_words(at_close) + "; ";
  return words;
}

std::string AppendFile::in_words(Failure failure) {
  auto step = [&]() -> std::string {
    switch (failure.step) {
      case Step::kNone: return "no failure";
      case Step::kAppendWidth: return "a row did not have one value for each column";
      case Step::kAppendClosed: return "a row came after the file was closed";
      case Step::kAppendUnfit: return "a row could not be encoded";
      case Step::kInspect: return "cannot inspect the file";
      case Step::kFoundDeleted: return "the file was deleted while it was being written";
      case Step::kFoundShortened: return "another program cut the file short";
      case Step::kWrite: return "cannot write rows";
      case Step::kCutTornRow: return "cannot cut off a torn row, so the last line may be torn";
      case Step::kSync: return "the disk did not confirm the last rows (fsync)";
      case Step::kClose: return "cannot close the file";
    }
    return "unknown failure";
  }();
  if (failure.error_number == 0) return step;
  return step + ": " + std::generic_category().message(failure.error_number);
}

}  // namespace runtime
