/// @file
#pragma once
#include <signal.h>

#include <ctime>

namespace runtime {

/// A write past RLIMIT_FSIZE raises SIGXFSZ in the writing thread, whose default action ends the process.
/// This blocks the signal for a scope and discards it; the write reports EFBIG anyway.
class FileSizeSignalHeldBack {
 public:
  FileSizeSignalHeldBack() noexcept {
    sigemptyset(&held_);
    sigaddset(&held_, SIGXFSZ);
    pthread_sigmask(SIG_BLOCK, &held_, &before_);
  }
  FileSizeSignalHeldBack(const FileSizeSignalHeldBack&) = delete;
  FileSizeSignalHeldBack& operator=(const FileSizeSignalHeldBack&) = delete;
  ~FileSizeSignalHeldBack() {
    const timespec at_once{};
    if (sigismember(&before_, SIGXFSZ) == 0) sigtimedwait(&held_, nullptr, &at_once);
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }

 private:
  sigset_t held_{};
  sigset_t before_{};
};

}  // namespace runtime
