#include "runtime/mcap/new_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "drivers/uninterrupted.h"
#include "hal/setup_error.h"
#include "runtime/recording/file_size_signal.h"

namespace runtime::mcap {

NewFile::NewFile(const std::filesystem::path& path) : path_(path) {
  fd_ = drivers::uninterrupted(
      [this] { return ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644); });
  if (fd_ < 0)
    refuse("cannot create the file", errno,
           errno == EEXIST ? "it is not replaced; choose another path"
                           : "the folder must exist and be writable");
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

void NewFile::refuse(const char* what, int error, const char* hint) const {
  throw hal::SetupError(path_.string(), std::string(what) + ": " + std::generic_category().message(error),
                        hint);
}

}  // namespace runtime::mcap
