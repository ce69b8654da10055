/// @file
/// Files and directories created in set-up, until the work begins.
#pragma once
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

namespace runtime {

/// The destructor removes them, the last one first, unless keep() was called: a failed set-up leaves nothing
/// behind. A directory that contains something else stays. One thread at a time.
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
  /// From now on they contain results.
  void keep() noexcept { paths_.clear(); }

 private:
  std::vector<std::filesystem::path> paths_;
};

}  // namespace runtime
