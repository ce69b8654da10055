#include "runtime/mcap/mcap_format.h"

#include <cstddef>
#include <exception>
#include <stdexcept>
#include <utility>

namespace runtime::mcap {

McapFormat::McapFormat(const std::vector<RecordingFile::Comment>& comments,
                       const std::vector<RecordingFile::Column>& columns,
                       const std::vector<RecordingFile::Attachment>& attachments)
    : writer_([this](std::string_view bytes) { write(bytes); }, recording_options()) {
  const RecordingHead head{comments, columns};
  rows_.emplace(writer_, head);
  for (const RecordingFile::Attachment& attachment : attachments)
    writer_.add_attachment(toml_attachment(attachment.name, attachment.text, head.start_ns()));
}

void McapFormat::write(std::string_view bytes) {
  if (file_ == nullptr) {
    head_ += bytes;
    return;
  }
  // A part of a chunk is of no use.
  const std::size_t kept = file_->append(bytes, [](std::span<const char>) { return std::size_t{0}; });
  if (kept != bytes.size()) throw std::runtime_error("not written");  // the file keeps the reason
}

bool McapFormat::append_row(std::span<const double> values) noexcept {
  try {
    rows_->append_row(values);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

std::uint64_t McapFormat::write_to(AppendFile& file) noexcept {
  const std::uint64_t rows = rows_->rows_in_block();
  file_ = &file;
  try {
    rows_->end_block();
    return rows;
  } catch (const std::exception&) {
    rows_->discard_block();
    return 0;
  }
}

void McapFormat::finish(AppendFile& file) noexcept {
  file_ = &file;
  try {
    writer_.finish();
  } catch (const std::exception&) {  // the file can still be read without its summary
  }
}

}  // namespace runtime::mcap
