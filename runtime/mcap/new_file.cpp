#include "runtime/mcap/new_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>
#include <utility>

#include "drivers/uninterrupted.h"
#include "hal/setup_error.h"
#include "runtime/recording/file_size_signal.h"

namespace runtime::mcap {
namespace {

constexpr const char* kNotReplaced = "it is not replaced; choose another path";

}  // namespace

NewFile::NewFile(const std::filesystem::path& path) : path_(path) {
  fd_ = drivers::uninterrupted(
      [this] { return ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644); });
  if (fd_ < 0)
    refuse("cannot create the file", errno,
           errno == EEXIST ? kNotReplaced : "the folder must exist and be writable");
}

NewFile::~NewFile() {
  if (fd_ >= 0) ::close(fd_);
  if (!finished_) ::unlink(path_.c_str());
}

void NewFile::write(std::string_view bytes) {
  const FileSizeSignalHeldBack held_back;
  while (!bytes.empty()) {
    const ssize_t count = drivers::uninterrupted([&] { return ::write(fd_, bytes.data(), bytes.size()); });
    // No file system should return 0; a retry might never end.
    if (count <= 0) refuse("cannot write", count < 0 ? errno : ENOSPC, "make room or choose another folder");
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
}

void NewFile::finish() {
  if (drivers::uninterrupted([this] { return ::fsync(fd_); }) != 0)
    refuse("the disk did not confirm the file", errno, "choose another folder");
  // The descriptor is closed even after EINTR.
  if (::close(std::exchange(fd_, -1)) != 0 && errno != EINTR)
    refuse("cannot close the file", errno, "choose another folder");
  finished_ = true;
}

void require_absent(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::exists(std::filesystem::symlink_status(path, error)))
    throw hal::SetupError(path.string(), "the file exists", kNotReplaced);
}

void publish(const std::filesystem::path& part, const std::filesystem::path& path) {
  int failed = ::renameat2(AT_FDCWD, part.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE) == 0 ? 0 : errno;
  if (failed == EINVAL) {  // this file system cannot promise it
    require_absent(path);
    failed = ::rename(part.c_str(), path.c_str()) == 0 ? 0 : errno;
  }
  if (failed == 0) return;
  ::unlink(part.c_str());
  throw hal::SetupError(path.string(), "cannot create the file: " + std::generic_category().message(failed),
                        kNotReplaced);
}

void NewFile::refuse(const char* what, int error, const char* hint) const {
  throw hal::SetupError(path_.string(), std::string(what) + ": " + std::generic_category().message(error),
                        hint);
}

}  // namespace runtime::mcap
