/// @file
/// A file that is created and written from its beginning to its end, and its name.
#pragma once
#include <filesystem>
#include <string_view>

namespace runtime::mcap {

/// Each write() reaches the operating system before it returns, so it survives the end of this process. The
/// destructor removes the file unless it is finished.
class NewFile {
 public:
  /// @throws hal::SetupError if the file exists or cannot be created.
  explicit NewFile(const std::filesystem::path& path);
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  ~NewFile();

  /// @throws hal::SetupError, for example for a full disk.
  void write(std::string_view bytes);
  /// Waits until everything is on disk, closes and keeps the file. @throws hal::SetupError
  void finish();

 private:
  [[noreturn]] void refuse(const char* what, int error, const char* hint) const;

  std::filesystem::path path_;
  int fd_ = -1;
  bool finished_ = false;
};

/// @throws hal::SetupError if there is such a file.
void require_absent(const std::filesystem::path& path);
/// Gives the finished file `part` its name. @throws hal::SetupError if there is such a file; `part` is
/// removed.
void publish(const std::filesystem::path& part, const std::filesystem::path& path);

}  // namespace runtime::mcap
