/// @file
/// What a set-up has made on disk, until the work begins.
#pragma once
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

namespace runtime {

/// Files and directories, removed again at destruction, the last one first, unless they are to be kept: a
/// set-up that fails leaves nothing behind. A directory that holds something else stays. One thread at a
/// time.
class MadePaths {
 public:
  MadePaths() = default;
  /// Outermost first.
  explicit MadePaths(std::vector<std::filesystem::path> paths) : paths_(std::move(paths)) {}
  MadePaths(const MadePaths&) = delete;
  MadePaths& operator=(const MadePaths&) = delete;
  ~MadePaths() {
    std::error_code stays;
    for (; !paths_.empty(); paths_.pop_back()) std::filesystem::remove(paths_.back(), stays);
  }

  void add(std::filesystem::path path) { paths_.push_back(std::move(path)); }
  void add(const std::vector<std::filesystem::path>& paths) {
    paths_.insert(paths_.end(), paths.begin(), paths.end());
  }
  /// From now on there is something worth keeping.
  void keep() noexcept { paths_.clear(); }

 private:
  std::vector<std::filesystem::path> paths_;
};

}  // namespace runtime
