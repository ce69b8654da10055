/// @file
/// Recordings as text: `# youbot recording v1`, `# key: value` lines, column names, rows of numbers.
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "runtime/recording/recording_file.h"
#include "runtime/recording/row_format.h"

namespace runtime {

/// append_row() and write_to() allocate nothing.
class CsvFormat : public RowFormat {
 public:
  CsvFormat(const std::vector<RecordingFile::Comment>& comments,
            const std::vector<RecordingFile::Column>& columns);

  const std::string& head() const noexcept override { return head_; }
  bool append_row(std::span<const double> values) noexcept override;
  bool full() const noexcept override { return buffer_.size() - buffered_bytes_ < longest_row_bytes_; }
  std::uint64_t rows_in_memory() const noexcept override { return buffered_rows_; }
  std::uint64_t write_to(AppendFile& file) noexcept override;
  void discard_rows() noexcept override { buffered_bytes_ = buffered_rows_ = 0; }

 private:
  std::string head_;
  std::vector<std::optional<int>> decimals_;  // by column
  std::size_t longest_row_bytes_ = 0;
  std::vector<char> buffer_;  // complete rows only
  std::size_t buffered_bytes_ = 0;
  std::uint64_t buffered_rows_ = 0;
};

}  // namespace runtime
