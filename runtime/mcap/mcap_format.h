/// @file
/// Recordings as MCAP, as the writer's thread of a run writes them.
#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runtime/mcap/mcap_writer.h"
#include "runtime/mcap/recording_writer.h"
#include "runtime/recording/recording_file.h"
#include "runtime/recording/row_format.h"

namespace runtime::mcap {

/// Each write_to() appends a complete chunk, so a killed program loses no more than the rows since the last
/// one. Only finish() writes the summary.
class McapFormat : public RowFormat {
 public:
  /// @throws std::invalid_argument without a column `time_s`.
  McapFormat(const std::vector<RecordingFile::Comment>& comments,
             const std::vector<RecordingFile::Column>& columns,
             const std::vector<RecordingFile::Attachment>& attachments);

  const std::string& head() const noexcept override { return head_; }
  bool append_row(std::span<const double> values) noexcept override;
  bool full() const noexcept override { return rows_->full(); }
  std::uint64_t rows_in_memory() const noexcept override { return rows_->rows_in_block(); }
  std::uint64_t write_to(AppendFile& file) noexcept override;
  void discard_rows() noexcept override { rows_->discard_block(); }
  void finish(AppendFile& file) noexcept override;

 private:
  void write(std::string_view bytes);

  std::string head_;
  AppendFile* file_ = nullptr;  // during write_to() and finish()
  McapWriter writer_;
  std::optional<RecordingWriter> rows_;
};

}  // namespace runtime::mcap
