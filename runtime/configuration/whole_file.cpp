#include "runtime/configuration/whole_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "drivers/uninterrupted.h"
#include "hal/setup_error.h"
#include "runtime/recording/file_size_signal.h"

namespace runtime {
namespace {

/// An open file with a temporary name, removed unless it gets its final one.
class Unfinished {
 public:
  explicit Unfinished(const std::filesystem::path& path)
      : path_(path), beside_(path.string() + "." + std::to_string(::getpid()) + ".tmp") {
    fd_ = drivers::uninterrupted(
        [this] { return ::open(beside_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666); });
    if (fd_ < 0) refuse("cannot be created", "its folder must exist and be writable");
  }
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;
  ~Unfinished() {
    if (fd_ >= 0) ::close(fd_);
    if (!renamed_) ::unlink(beside_.c_str());
  }

  void write(std::string_view text) {
    const FileSizeSignalHeldBack held_back;
    while (!text.empty()) {
      const ssize_t count = drivers::uninterrupted([&] { return ::write(fd_, text.data(), text.size()); });
      if (count == 0) errno = ENOSPC;
      if (count <= 0) refuse("cannot be written", "make room or choose another folder");
      text.remove_prefix(static_cast<std::size_t>(count));
    }
  }
  void finish() {
    // Before the rename: after a power cut the name must not refer to a file without content.
    const bool on_disk = drivers::uninterrupted([this] { return ::fsync(fd_); }) == 0;
    // It is closed even after EINTR.
    if (!on_disk || (::close(std::exchange(fd_, -1)) != 0 && errno != EINTR))
      refuse("cannot be finished", "choose another folder");
    if (::rename(beside_.c_str(), path_.c_str()) != 0)
      refuse("cannot replace the older file", "choose another path");
    renamed_ = true;
  }

 private:
  [[noreturn]] void refuse(const std::string& what, const char* hint) const {
    const int error = errno;
    throw hal::SetupError(path_.string(), what + ": " + std::generic_category().message(error), hint);
  }

  std::filesystem::path path_;
  std::string beside_;
  int fd_ = -1;
  bool renamed_ = false;
};

}  // namespace

void write_whole_file(const std::filesystem::path& path, std::string_view text) {
  // The rename would replace a device, such as /dev/null, by a file.
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode))
    throw hal::SetupError(path.string(), "not a regular file", "choose another path");
  Unfinished file(path);
  file.write(text);
  file.finish();
}

}  // namespace runtime
