/// @file
/// A published table: one row of column names, then numbers (or words) with commas between.
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace real_recordings {

class SourceTable {
 public:
  /// @throws std::runtime_error naming file and line; a table needs at least two rows.
  explicit SourceTable(const std::filesystem::path& path);

  std::size_t rows() const noexcept { return rows_.size(); }
  /// @throws std::runtime_error naming the file if there is no such column, or a field is not a finite
  /// number.
  std::vector<double> column(std::string_view name) const;
  std::vector<std::string> words(std::string_view name) const;

 private:
  std::string path_;
  std::vector<std::string> names_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace real_recordings
