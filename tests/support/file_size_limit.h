/// @file
#pragma once
#include <signal.h>
#include <sys/resource.h>

#include <cstdint>
#include <stdexcept>

namespace support {

/// Until the end of the scope no file of this process grows past `bytes`: write() then stops short and
/// fails as it does on a full disk, with EFBIG in place of ENOSPC.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(std::uintmax_t bytes, void (*on_signal)(int) = SIG_IGN) {
    struct sigaction action {};
    action.sa_handler = on_signal;
    sigaction(SIGXFSZ, &action, &action_before_);
    getrlimit(RLIMIT_FSIZE, &limit_before_);
    const rlimit limit{.rlim_cur = bytes, .rlim_max = limit_before_.rlim_max};
    if (setrlimit(RLIMIT_FSIZE, &limit) != 0) throw std::runtime_error("setrlimit refused");
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &limit_before_);
    sigaction(SIGXFSZ, &action_before_, nullptr);
  }

 private:
  struct sigaction action_before_ {};
  rlimit limit_before_{};
};

}  // namespace support
