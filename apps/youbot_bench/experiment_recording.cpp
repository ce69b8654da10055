#include "apps/youbot_bench/experiment_recording.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "hal/setup_error.h"
#include "runtime/configuration/regular_file.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/program/build_info.h"
#include "runtime/recording/output_directory.h"
#include "runtime/recording/recording_reader.h"
#include "runtime/recording/started.h"

namespace youbot_bench {
namespace {

namespace fs = std::filesystem;
using Column = runtime::RecordingFile::Column;
using Comment = runtime::RecordingFile::Comment;

/// 8 s at 1 kHz: longer than a disk stalls.
constexpr std::size_t kRingCapacity = 8192;

std::string shortest(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

/// Parses the numbers of a data line. False if the line contains anything else, or another number of values.
bool parse_row(std::string_view line, std::vector<double>& row) {
  const char* at = line.data();
  const char* const end = at + line.size();
  for (double& value : row) {
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc()) return false;
    const bool last = &value == &row.back();
    if (last != (next == end) || (!last && *next != ',')) return false;
    at = next + 1;
  }
  return true;
}

std::string header_of(const std::vector<Column>& columns) {
  std::string header;
  for (const Column& column : columns) header += (header.empty() ? "" : ",") + column.name;
  return header;
}

/// @throws hal::SetupError if it cannot be read to its end: the rest would count as not measured.
/// std::invalid_argument if it does not exist, or is larger than any readable recording.
std::string text_of(const fs::path& path) {
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(path, error);
  if (error == std::errc::no_such_file_or_directory)
    throw std::invalid_argument("--resume: " + path.string() + " is not there");
  if (!error && bytes > runtime::kMaxRecordingBytes)
    throw std::invalid_argument("--resume: " + path.string() + " has " + std::to_string(bytes) +
                                " bytes, but at most " + std::to_string(runtime::kMaxRecordingBytes) +
                                " are read");
  try {
    return runtime::read_regular_file(path, runtime::kMaxRecordingBytes);
  } catch (const std::runtime_error& why) {
    throw hal::SetupError("--resume: " + path.string(), why.what(), "the recording stays as it was");
  }
}

/// When the measurement began that is resumed: its rows keep their times. Now, if the file does not say it.
Comment started_of(const fs::path& recording) {
  constexpr std::string_view kStarted = "# started: ";
  std::istringstream text(text_of(recording));
  for (std::string line; std::getline(text, line) && line.starts_with('#');)
    if (line.starts_with(kStarted)) return {"started", line.substr(kStarted.size())};
  return runtime::started_now();
}

/// Calls `take` for each row of the recording at `path`.
/// @throws as text_of(); std::invalid_argument if it has other columns, or naming the line of a row that is
/// damaged or whose time decreases.
template <typename Take>
void for_each_row(const fs::path& path, const std::vector<Column>& columns, Take take) {
  const std::string text = text_of(path);
  std::string_view left = text;
  std::string_view line;
  int number = 0;
  bool whole = true;
  const auto next_line = [&] {
    if (left.empty()) return false;
    const std::size_t end = left.find('\n');
    whole = end != left.npos;
    line = left.substr(0, end);
    left.remove_prefix(whole ? end + 1 : left.size());
    ++number;
    return true;
  };
  while (next_line() && line.starts_with('#')) {
  }
  if (line != header_of(columns))
    throw std::invalid_argument("--resume: " + path.string() + " has the columns '" +
                                std::string(line.substr(0, 200)) + "', not those of this experiment");
  std::vector<double> row(columns.size());
  const auto refuse = [&path](int at, const std::string& why) {
    throw std::invalid_argument("--resume: " + path.string() + ":" + std::to_string(at) + ": " + why +
                                "; delete this line and all behind it");
  };
  double last_s = 0;
  int unreadable = 0;
  while (next_line() && whole) {  // a last line without its line end was torn
    if (!parse_row(line, row)) {
      unreadable = unreadable > 0 ? unreadable : number;  // possible at the end of a file after a power cut
      continue;
    }
    if (unreadable > 0) refuse(unreadable, "no row of this recording, but others follow");
    if (!std::isfinite(row[0]) || row[0] < last_s)
      refuse(number, "time_s is " + shortest(row[0]) + " after " + shortest(last_s));
    last_s = row[0];
    take(std::span<const double>(row));
  }
}

/// A comment for each reason, with its columns.
std::vector<Comment> reason_comments(const std::string& joint, const std::vector<std::string>& columns,
                                     const std::vector<std::string>& reasons) {
  std::map<std::string, std::string> columns_of;
  for (std::size_t i = 0; i < reasons.size(); ++i) {
    std::string& names = columns_of[reasons[i]];
    names += (names.empty() ? "" : ",") + columns[i];
  }
  columns_of.erase("");
  std::vector<Comment> comments;
  comments.reserve(columns_of.size());
  for (const auto& [reason, names] : columns_of)
    comments.push_back({"not_measured", names + ": " + joint + " " + reason});
  return comments;
}

bool has_files(const fs::path& directory) {
  std::error_code unknown;
  return fs::exists(directory, unknown) && !fs::is_empty(directory, unknown);
}

}  // namespace

bool ExperimentRecording::holds_recording(const Description& description) {
  return has_files(description.directory / description.experiment) ||
         (!description.result_columns.empty() && has_files(description.directory / description.result));
}

ExperimentRecording::ExperimentRecording(const Description& description, bool resume)
    : resume_(resume),
      finished_(resume ? -1 : 0),
      result_values_(description.result_columns.size()),
      joints_(description.joints),
      result_names_(description.result_columns),
      reasons_(description.not_measured) {
  const fs::path rows_directory = description.directory / description.experiment;
  const fs::path result_directory = description.directory / description.result;
  if (!resume && holds_recording(description))
    throw std::invalid_argument(
        "--out: " + rows_directory.string() +
        " holds a recording already; name another directory, or go on with --resume " +
        description.directory.string());
  if (!resume_) {
    made_.add(runtime::make_output_directory(rows_directory));
    if (result_values_ > 0) made_.add(runtime::make_output_directory(result_directory));
    made_.add(rows_directory / "experiment.toml");
    runtime::write_whole_file(rows_directory / "experiment.toml", description.configuration);
  }

  const std::vector<Column> progress_columns{{"time_s", 6}, {"measurement", 0}};
  std::vector<Column> result_columns{{"time_s", 6}};
  for (const std::string& name : description.result_columns) result_columns.push_back({name, 9});
  if (resume_) {
    count_finished(rows_directory / "progress", progress_columns);
    // A power cut may have kept the last line but not the data before it.
    for (const std::string& joint : description.joints)
      if (result_values_ > 0) count_finished(result_directory / (joint + ".csv"), result_columns);
  }
  const auto finished = [this](std::span<const double>, int number) { return number < finished_; };
  const auto finished_result = [&](std::span<const double> row, int number) {
    if (finished(row, number)) note_missing(results_.size(), number, row.subspan(1));
    return finished(row, number);
  };

  const Comment started =
      resume_ ? started_of(rows_directory / (description.joints.front() + ".csv")) : runtime::started_now();
  const std::vector<Comment> common{
      {"sample_rate_Hz", shortest(description.rate_Hz)}, started, {"software", runtime::build_version()}};
  const auto comments = [&common](const std::string& rig, const std::string& experiment) {
    std::vector<Comment> result{{"rig", rig}, {"experiment", experiment}};
    result.insert(result.end(), common.begin(), common.end());
    return result;
  };
  const std::vector<Column> columns = choose_columns(description.commands);
  for (const std::string& joint : description.joints) {
    rows_.push_back(open(
        rows_directory / (joint + ".csv"), comments(joint, description.experiment), columns,
        [this](std::span<const double> row, int) { return row[0] <= finished_until_s_ + kTimeGrain_s; }));
    if (result_values_ > 0) {
      std::vector<Comment> result_comments{{"rig", joint},
                                           {"experiment", description.result},
                                           started,
                                           {"software", runtime::build_version()}};
      std::ranges::move(reason_comments(joint, description.result_columns, reasons_),
                        std::back_inserter(result_comments));
      results_.push_back(
          open(result_directory / (joint + ".csv"), result_comments, result_columns, finished_result));
    }
  }
  progress_ =
      open(rows_directory / "progress", {{"experiment", description.experiment}}, progress_columns, finished);
  line_.resize(1 + std::max(row_values_.size(), result_values_));
  recorder_.emplace(
      kRingCapacity, [this](const ExperimentRecord& record) { write(record); },
      [this, also = description.about_every_100_ms] {
        if (!failed()) flush_all(rows_);
        also();
      });
}

std::vector<Column> ExperimentRecording::choose_columns(
    const identification::experiments::RecordedCommands& commands) {
  std::vector<Column> columns{{"time_s", 6}};
  const auto add = [&](const char* name, int decimals, ExperimentRecord::Value value) {
    columns.push_back({name, decimals});
    row_values_.push_back(value);
  };
  if (commands.torque) add("torque_command_Nm", 6, ExperimentRecord::kTorqueCommand);
  add("torque_measured_Nm", 6, ExperimentRecord::kTorqueMeasured);
  add("position_rad", 7, ExperimentRecord::kPosition);
  add("velocity_rad_per_s", 6, ExperimentRecord::kVelocity);
  if (commands.velocity) add("velocity_command_rad_per_s", 6, ExperimentRecord::kVelocityCommand);
  if (commands.position) add("position_command_rad", 7, ExperimentRecord::kPositionCommand);
  return columns;
}

void ExperimentRecording::count_finished(const fs::path& path, const std::vector<Column>& columns) {
  std::vector<double> times_s;
  for_each_row(path, columns, [&times_s](std::span<const double> row) { times_s.push_back(row[0]); });
  if (finished_ < 0) finished_times_s_ = times_s;
  finished_times_s_.resize(std::min(finished_times_s_.size(), times_s.size()));
  for (std::size_t i = 0; i < finished_times_s_.size(); ++i)
    if (std::abs(times_s[i] - finished_times_s_[i]) > kTimeGrain_s)
      throw std::invalid_argument("--resume: " + path.string() + ": measurement " + std::to_string(i + 1) +
                                  " ended at " + shortest(times_s[i]) + " s, but by 'progress' at " +
                                  shortest(finished_times_s_[i]) + " s; the files are of several runs");
  finished_ = static_cast<int>(finished_times_s_.size());
  finished_until_s_ = finished_times_s_.empty() ? -1.0 : finished_times_s_.back();
}

ExperimentRecording::File ExperimentRecording::open(
    const fs::path& path, const std::vector<Comment>& comments, const std::vector<Column>& columns,
    const std::function<bool(std::span<const double>, int)>& keep) {
  const fs::path fresh = path.string() + (resume_ ? ".resumed" : "");
  // An interrupted resumption may have left one.
  auto file = std::make_unique<runtime::RecordingFile>(
      fresh, comments, columns,
      resume_ ? runtime::RecordingFile::Existing::kReplace : runtime::RecordingFile::Existing::kRefuse);
  made_.add(fresh);
  if (!resume_) return file;
  int number = 0;
  for_each_row(path, columns, [&](std::span<const double> row) {
    if (keep(row, number++)) file->append_row(row);
  });
  file->flush();
  std::error_code error;
  if (file->error().empty()) fs::rename(fresh, path, error);
  if (!file->error().empty() || error)
    throw hal::SetupError(path.string(), "take over the earlier recording",
                          error ? error.message() : file->error());
  return file;
}

void ExperimentRecording::write(const ExperimentRecord& record) {
  if (failed()) return;
  line_[0] = record.time_s;
  if (record.kind == ExperimentRecord::Kind::kRow) {
    for (std::size_t joint = 0; joint < rows_.size(); ++joint) {
      for (std::size_t i = 0; i < row_values_.size(); ++i)
        line_[i + 1] = record.values[joint][row_values_[i]];
      rows_[joint]->append_row(std::span(line_).first(1 + row_values_.size()));
      if (rows_[joint]->rows_lost() > 0) failed_.store(true, std::memory_order_relaxed);
    }
    return;
  }
  if (!flush_all(rows_)) return;
  for (std::size_t joint = 0; joint < results_.size(); ++joint) {
    std::copy_n(record.values[joint].begin(), result_values_, line_.begin() + 1);
    results_[joint]->append_row(std::span(line_).first(1 + result_values_));
    note_missing(joint, record.measurement, std::span(line_).subspan(1, result_values_));
  }
  if (!flush_all(results_)) return;
  progress_->append_row(std::array{record.time_s, static_cast<double>(record.measurement)});
  progress_->flush();
  if (!progress_->error().empty()) failed_.store(true, std::memory_order_relaxed);
}

void ExperimentRecording::note_missing(std::size_t joint, int measurement, std::span<const double> values) {
  for (std::size_t i = 0; i < std::min(values.size(), reasons_.size()); ++i) {
    if (!std::isnan(values[i])) continue;
    not_measured_.push_back(
        joints_[joint] + ", measurement " + std::to_string(measurement + 1) + ": " +
        (reasons_[i].empty() ? result_names_[i] + " could not be computed" : reasons_[i]));
    return;  // missing values further right follow from it
  }
}

bool ExperimentRecording::flush_all(std::vector<File>& files) {
  for (const File& file : files) file->flush();
  if (std::any_of(files.begin(), files.end(), [](const File& file) { return !file->error().empty(); }))
    failed_.store(true, std::memory_order_relaxed);
  return !failed();
}

void ExperimentRecording::close() noexcept {
  recorder_->stop();
  for (const File& file : rows_) file->close();
  for (const File& file : results_) file->close();
  progress_->close();
}

std::vector<std::string> ExperimentRecording::problems() const {
  std::vector<std::string> problems;
  for (const auto* files : {&rows_, &results_})
    for (const File& file : *files)
      if (!file->error().empty()) problems.push_back(file->error());
  if (!progress_->error().empty()) problems.push_back(progress_->error());
  if (const auto dropped = recorder_->statistics().dropped; dropped > 0)
    problems.push_back("the disk was too slow: " + std::to_string(dropped) + " records lost");
  if (const std::string failure = recorder_->first_sink_failure(); !failure.empty())
    problems.push_back(failure);
  return problems;
}

std::uint64_t ExperimentRecording::rows_on_disk() const noexcept {
  std::uint64_t least = rows_.front()->rows_written();
  for (const File& file : rows_) least = std::min(least, file->rows_written());
  return least;
}

}  // namespace youbot_bench
