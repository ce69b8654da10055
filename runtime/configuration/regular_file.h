/// @file
#pragma once
#include <sys/stat.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace runtime {

enum class Content : std::uint8_t { kText, kBytes };

/// Set-up. A file that is read piece by piece. Non-regular files are rejected as below, and UTF-16 as text.
/// @throws std::runtime_error with the reason, without the path.
class RegularFile {
 public:
  explicit RegularFile(const std::filesystem::path& path, Content content = Content::kText);
  RegularFile(const RegularFile&) = delete;
  RegularFile& operator=(const RegularFile&) = delete;
  ~RegularFile();

  /// Size when opened; 0 for files of the kernel.
  std::size_t size_bytes() const noexcept { return static_cast<std::size_t>(status_.st_size); }
  /// Owner and mode of the open file, even if its path now leads elsewhere.
  uid_t owner() const noexcept { return status_.st_uid; }
  bool group_or_others_may_write() const noexcept { return (status_.st_mode & (S_IWGRP | S_IWOTH)) != 0; }
  /// Bytes read; 0 at the end.
  std::size_t read(char* buffer, std::size_t size) const;

 private:
  int fd_ = -1;
  struct stat status_ {};
};

/// Set-up. The rest of the file, at most `limit_bytes`. @throws std::runtime_error likewise.
std::string read_whole(const RegularFile& file, std::size_t limit_bytes);

/// Set-up. The whole content of a regular file of at most `limit_bytes`. Anything else of that name, such as
/// a pipe, a device or an endless file of the kernel, is rejected without waiting.
/// @throws std::runtime_error with the reason, without the path.
std::string read_regular_file(const std::filesystem::path& path, std::size_t limit_bytes,
                              Content content = Content::kText);

}  // namespace runtime
