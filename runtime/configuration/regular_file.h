/// @file
#pragma once
#include <sys/stat.h>

#include <cstddef>
#include <filesystem>
#include <string>

namespace runtime {

/// Set-up. A file of which no more than a piece has to be in memory. What is not regular is refused as below.
/// @throws std::runtime_error with the reason, without the path.
class RegularFile {
 public:
  explicit RegularFile(const std::filesystem::path& path);
  RegularFile(const RegularFile&) = delete;
  RegularFile& operator=(const RegularFile&) = delete;
  ~RegularFile();

  /// As it was opened; a file of the kernel: 0.
  std::size_t size_bytes() const noexcept { return static_cast<std::size_t>(status_.st_size); }
  /// Of what is open, whatever its path leads to by now.
  uid_t owner() const noexcept { return status_.st_uid; }
  bool group_or_others_may_write() const noexcept { return (status_.st_mode & (S_IWGRP | S_IWOTH)) != 0; }
  /// Bytes read; 0 at the end.
  std::size_t read(char* buffer, std::size_t size) const;

 private:
  int fd_ = -1;
  struct stat status_ {};
};

/// Set-up. The rest of the file, which has at most `limit_bytes`. @throws std::runtime_error likewise.
std::string read_whole(const RegularFile& file, std::size_t limit_bytes);

/// Set-up. The whole text of a regular file of at most `limit_bytes`. Anything else of that name, such as a
/// pipe, a device or a file of the kernel that has no end, is refused and never waited for.
/// @throws std::runtime_error with the reason, without the path.
std::string read_regular_file(const std::filesystem::path& path, std::size_t limit_bytes);

}  // namespace runtime
