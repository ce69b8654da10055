/// @file
/// A directory for the files of one test: tests run in parallel processes, so shared resources must not have
/// fixed names.
#pragma once
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <ios>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

namespace support {

/// New and empty; removed with its content by the destructor.
class TemporaryDirectory {
 public:
  /// Throws std::runtime_error if it cannot be created.
  TemporaryDirectory() {
    const std::string pattern = (std::filesystem::temp_directory_path() / "youbot-test-XXXXXX").string();
    std::string made = pattern;
    if (mkdtemp(made.data()) == nullptr)
      throw std::runtime_error(pattern + ": cannot be made: " + std::generic_category().message(errno));
    path_ = made;
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  ~TemporaryDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(std::string_view name) const { return path_ / name; }

  /// Writes `text` to a file and returns its path; creates missing directories in `name`. Throws
  /// std::runtime_error if it could not be written.
  std::filesystem::path write(std::string_view name, std::string_view text) const {
    std::filesystem::path file = path_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream stream(file, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) throw std::runtime_error(file.string() + ": cannot be written");
    return file;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace support
