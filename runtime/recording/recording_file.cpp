#include "runtime/recording/recording_file.h"

#include <algorithm>
#include <stdexcept>

#include "runtime/mcap/mcap_format.h"
#include "runtime/recording/csv_format.h"

namespace runtime {
namespace {

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

/// What would break a recording as text, to which every recording can be converted.
/// @throws std::invalid_argument
void check(const std::filesystem::path& path, const std::vector<RecordingFile::Comment>& comments,
           const std::vector<RecordingFile::Column>& columns) {
  const auto require = [&path](bool condition, const std::string& problem) {
    if (!condition) throw std::invalid_argument("recording " + path.string() + ": " + problem);
  };
  for (const auto& [key, value] : comments) {
    require(!key.empty() && key.find(':') == std::string::npos && std::ranges::none_of(key, is_control),
            "comment key \"" + key + "\": expected one line without a colon");
    require(std::ranges::none_of(value, is_control),
            "comment \"" + key + "\": expected a value of one line, without control characters");
  }
  require(!columns.empty(), "expected at least one column");
  for (auto column = columns.begin(); column != columns.end(); ++column) {
    const auto& [name, decimals] = *column;
    require(!name.empty() && name.find_first_of(",#\" ") == std::string::npos &&
                std::ranges::none_of(name, is_control),
            "column \"" + name + "\": expected a name without comma, space, quote or #");
    require(std::ranges::count(columns.begin(), column, name, &RecordingFile::Column::name) == 0,
            "column \"" + name + "\" is given twice");
    require(!decimals || (*decimals >= 0 && *decimals <= RecordingFile::kMaxDecimals),
            "column \"" + name + "\": expected 0 to " + std::to_string(RecordingFile::kMaxDecimals) +
                " decimals");
  }
}

std::unique_ptr<RowFormat> make_format(const std::filesystem::path& path,
                                       const std::vector<RecordingFile::Comment>& comments,
                                       const std::vector<RecordingFile::Column>& columns,
                                       const std::vector<RecordingFile::Attachment>& attachments) {
  check(path, comments, columns);
  if (path.extension() == ".mcap") return std::make_unique<mcap::McapFormat>(comments, columns, attachments);
  return std::make_unique<CsvFormat>(comments, columns);
}

}  // namespace

RecordingFile::RecordingFile(const std::filesystem::path& path, const std::vector<Comment>& comments,
                             const std::vector<Column>& columns, Existing existing,
                             const std::vector<Attachment>& attachments)
    : width_(columns.size()),
      format_(make_format(path, comments, columns, attachments)),
      file_(path, format_->head(), existing) {}

RecordingFile::~RecordingFile() { close(); }

void RecordingFile::append_row(std::span<const double> values) noexcept {
  if (!file_.is_open()) return lose_row(AppendFile::Step::kAppendClosed);
  if (values.size() != width_) return lose_row(AppendFile::Step::kAppendWidth);
  if (format_->full()) flush();
  if (!format_->append_row(values)) lose_row(AppendFile::Step::kAppendUnfit);
}

void RecordingFile::flush() noexcept {
  const std::uint64_t rows = format_->rows_in_memory();
  if (rows == 0) return;
  std::uint64_t rows_kept = 0;
  if (restore())
    rows_kept = format_->write_to(file_);
  else
    format_->discard_rows();
  rows_written_.fetch_add(rows_kept, std::memory_order_relaxed);
  rows_lost_.fetch_add(rows - rows_kept, std::memory_order_relaxed);
}

void RecordingFile::close() noexcept {
  if (!file_.is_open()) return;
  flush();
  if (restore()) format_->finish(file_);
  file_.close();
}

bool RecordingFile::restore() noexcept {
  if (file_.restore()) return true;
  if (file_.is_lost())
    rows_lost_.fetch_add(rows_written_.exchange(0, std::memory_order_relaxed), std::memory_order_relaxed);
  return false;
}

void RecordingFile::lose_row(AppendFile::Step step) noexcept {
  file_.note(step, 0);
  rows_lost_.fetch_add(1, std::memory_order_relaxed);
}

std::string RecordingFile::error() const {
  std::string problem = file_.problem();
  if (problem.empty()) return problem;
  return problem + std::to_string(rows_lost()) + " rows lost, " + std::to_string(rows_written()) + " written";
}

}  // namespace runtime
