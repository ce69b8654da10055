/// @file
/// A file in memory for code that needs a path: the same one for all inputs.
#pragma once
#include <sys/mman.h>
#include <sys/types.h>
#include <unistd.h>

#include <cctype>
#include <span>
#include <string>
#include <string_view>

#include "tests/fuzz/fuzz_target.h"

namespace fuzz {

class MemoryFile {
 public:
  MemoryFile() : file_(memfd_create("fuzz", MFD_CLOEXEC)), path_("/proc/self/fd/" + std::to_string(file_)) {
    require(file_ >= 0);
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { close(file_); }

  void hold(std::span<const std::uint8_t> text) const {
    require(ftruncate(file_, 0) == 0);
    require(pwrite(file_, text.data(), text.size(), 0) == static_cast<ssize_t>(text.size()));
  }
  void hold(std::string_view text) const {
    hold({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  }
  const std::string& path() const noexcept { return path_; }

  /// Whether a problem starts with this file, and with a line of it if it could be read: "FILE:12: ...".
  bool names_line(std::string_view problem) const noexcept {
    return problem.starts_with(path_ + ":") && problem.size() > path_.size() + 1 &&
           std::isdigit(static_cast<unsigned char>(problem[path_.size() + 1])) != 0;
  }

 private:
  int file_;
  std::string path_;
};

inline Bytes bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

}  // namespace fuzz
