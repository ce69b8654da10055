#include "apps/youbotctl/files.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "hal/setup_error.h"
#include "runtime/log.h"
#include "runtime/mcap/convert.h"
#include "runtime/mcap/new_file.h"
#include "runtime/mcap/recover.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/wording.h"
#include "runtime/recording/bam_log.h"
#include "runtime/recording/recording_file.h"

namespace youbotctl {
namespace {

// Comments about the conversion itself.
constexpr const char* kConvertedFrom = "converted_from";
constexpr const char* kColumns = "columns";

std::string one_line(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 0x20 || c == 0x7F; }, ' ');
  return text;
}

/// The file has its name once it is complete. Returns the number of rows.
std::uint64_t write_complete(const std::filesystem::path& out,
                             const std::vector<runtime::RecordingFile::Comment>& comments,
                             const identification::Recording& recording) {
  std::filesystem::path part = out;
  part.replace_extension(".part" + out.extension().string());  // the extension is that of the format
  std::vector<runtime::RecordingFile::Column> columns;
  for (const auto& column : recording.columns) columns.push_back({column.name});
  runtime::RecordingFile file(part, comments, columns);
  try {
    std::vector<double> row(columns.size());
    for (std::size_t i = 0; i < recording.rows(); ++i) {
      for (std::size_t k = 0; k < row.size(); ++k) row[k] = recording.columns[k].values[i];
      file.append_row(row);
    }
    file.close();
    if (const std::string problem = file.error(); !problem.empty())
      throw hal::SetupError(out.string(), "write the recording: " + problem, "free some space");
  } catch (...) {
    std::error_code stays;
    std::filesystem::remove(part, stays);
    throw;
  }
  runtime::mcap::publish(part, out);
  return file.rows_written();
}

}  // namespace

int convert(const std::filesystem::path& in, const std::filesystem::path& out, const std::string& joint,
            bool quiet) {
  const runtime::mcap::Converted converted = runtime::mcap::convert(in, out, joint);
  for (const std::string& warning : converted.warnings) spdlog::warn("{}", warning);
  if (!quiet)
    std::printf("%s: %llu rows, %.1f MB, %.0f %% of %s\n", out.c_str(),
                static_cast<unsigned long long>(converted.rows),
                static_cast<double>(converted.bytes_out) / 1e6,
                100 * static_cast<double>(converted.bytes_out) / static_cast<double>(converted.bytes_in),
                in.filename().c_str());
  return runtime::kExitOk;
}

int import_table(const std::filesystem::path& in, const std::filesystem::path& out,
                 const std::filesystem::path& columns, bool quiet) {
  if (out.extension() != ".csv" && out.extension() != ".mcap")
    throw std::invalid_argument("convert: expected a .csv or an .mcap file to create, not " + out.string());
  runtime::mcap::require_absent(out);
  runtime::ReadOptions options;
  if (!columns.empty())
    options.columns = std::make_shared<runtime::ColumnMap>(runtime::read_column_map(columns));
  const runtime::ReadRecording read = runtime::read_recording_or_log(in, options);
  for (const std::string& warning : read.warnings) spdlog::warn("{}", warning);
  const identification::Recording& recording = read.recording;
  std::vector<runtime::RecordingFile::Comment> comments;
  if (std::ranges::find(recording.comments, "rig", &std::pair<std::string, std::string>::first) ==
          recording.comments.end() &&
      !recording.rig.empty())
    comments.push_back({"rig", recording.rig});
  // A recording's comments are single lines, and their keys have no colon.
  for (const auto& [key, value] : recording.comments)
    if (std::string name = one_line(key); !name.empty() && name != kConvertedFrom && name != kColumns) {
      std::ranges::replace(name, ':', '_');
      comments.push_back({name, one_line(value)});
    }
  comments.push_back({kConvertedFrom, one_line(in.filename().string())});
  if (!columns.empty()) comments.push_back({kColumns, one_line(columns.filename().string())});
  std::vector<runtime::RecordingFile::Column> names;
  for (const auto& column : recording.columns) names.push_back({column.name});
  const std::uint64_t rows = write_complete(out, comments, recording);
  if (!quiet)
    std::printf("%s: %llu rows of %s\n", out.c_str(), static_cast<unsigned long long>(rows),
                in.filename().c_str());
  return runtime::kExitOk;
}

int recover(const std::filesystem::path& in, const std::filesystem::path& out, bool quiet) {
  const runtime::mcap::Recovered recovered = runtime::mcap::recover(in, out);
  for (const std::string& problem : recovered.problems) spdlog::warn("{}", problem);
  if (quiet) return runtime::kExitOk;
  std::string lost;
  if (recovered.damaged_records > 0)
    lost = "; " + runtime::count_text(static_cast<long long>(recovered.damaged_records), "damaged record");
  if (recovered.torn_at) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(in, error);
    lost += fmt::format("; the file ends in a record that begins at byte {} of {}", *recovered.torn_at,
                        error ? 0 : size);
  }
  std::printf("%s: %llu messages over %.3f s%s\n", out.c_str(),
              static_cast<unsigned long long>(recovered.messages), recovered.duration_s,
              lost.empty() ? "; nothing was lost" : lost.c_str());
  return runtime::kExitOk;
}

}  // namespace youbotctl
