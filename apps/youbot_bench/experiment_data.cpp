#include "apps/youbot_bench/experiment_data.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <system_error>

#include "apps/youbot_bench/experiment_recording.h"
#include "runtime/configuration/regular_file.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/recording/recording_reader.h"

namespace youbot_bench {
namespace {

namespace fs = std::filesystem;

double number_or(std::string_view text, double otherwise) {
  double value = otherwise;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? value : otherwise;
}

/// "COLUMN,COLUMN: reason" → the reason, if a value of one of these columns is missing.
std::string reason_for_missing(const identification::Recording& results, std::string_view text) {
  const std::size_t colon = text.find(": ");
  if (colon == text.npos) return {};
  const std::string columns = "," + std::string(text.substr(0, colon)) + ",";
  for (const identification::Recording::Column& column : results.columns)
    if (columns.find("," + column.name + ",") != columns.npos &&
        std::ranges::any_of(column.values, [](double value) { return std::isnan(value); }))
      return std::string(text.substr(colon + 2));
  return {};
}

/// Empty, with a problem, if the file cannot be used.
identification::Recording read(const fs::path& path, std::vector<std::string>& problems) {
  try {
    return runtime::read_recording(path, runtime::NotMeasured::kTaken).recording;
  } catch (const runtime::RecordingError& error) {
    problems.emplace_back(error.what());
    return {};
  }
}

/// Format: `key = value # help`, except tables and comments. Empty, with a problem, if the file cannot be
/// read.
std::vector<Setting> read_settings(const fs::path& path, std::vector<std::string>& problems) {
  std::vector<Setting> settings;
  std::istringstream file;
  try {
    file.str(runtime::read_regular_file(path, runtime::kMaxToml_bytes));
  } catch (const std::runtime_error& error) {
    problems.push_back(path.string() + ": " + error.what());
  }
  for (std::string line; std::getline(file, line);) {
    const std::size_t equals = line.find(" = ");
    if (line.starts_with('#') || equals == line.npos) continue;
    const std::size_t help = line.find("  # ", equals);
    Setting setting{line.substr(0, equals), line.substr(equals + 3, help - equals - 3), {}};
    if (help != line.npos) setting.help = line.substr(help + 4);
    if (setting.value.size() >= 2 && setting.value.front() == '"')
      setting.value = setting.value.substr(1, setting.value.size() - 2);
    settings.push_back(std::move(setting));
  }
  return settings;
}

}  // namespace

double MeasuredExperiment::setting(std::string_view key, double otherwise) const {
  const auto found = std::ranges::find(settings, key, &Setting::key);
  return found == settings.end() ? otherwise : number_or(found->value, otherwise);
}

bool holds_experiment(const fs::path& directory, const std::string& experiment) {
  std::error_code unknown;
  return fs::is_regular_file(directory / experiment / "progress", unknown);
}

MeasuredExperiment read_experiment(const fs::path& directory, const std::string& experiment,
                                   const std::string& result, bool with_rows) {
  MeasuredExperiment measured;
  measured.name = experiment;
  const fs::path rows = directory / experiment;
  measured.settings = read_settings(rows / "experiment.toml", measured.problems);
  std::vector<std::string> nothing_finished;
  const identification::Recording progress = read(rows / "progress", nothing_finished);
  if (progress.has("time_s")) {
    const auto ends = progress.column("time_s");
    measured.finished_until_s.assign(ends.begin(), ends.end());
  }

  std::vector<fs::path> files;
  std::error_code error;
  for (auto entry = fs::directory_iterator(rows, error); !error && entry != fs::directory_iterator();
       entry.increment(error))
    if (runtime::is_recording(*entry)) files.push_back(entry->path());
  if (error) measured.problems.push_back(rows.string() + ": " + error.message());
  std::ranges::sort(files);
  for (const fs::path& file : files) {
    MeasuredJoint joint{.name = file.stem().string(), .rows = {}, .results = {}};
    if (with_rows) joint.rows = read(file, measured.problems);
    if (!result.empty() && !measured.finished_until_s.empty())
      joint.results = read(directory / result / file.filename(), measured.problems);
    for (const auto& [key, text] : joint.results.comments) {
      if (key != "not_measured") continue;
      if (std::string reason = reason_for_missing(joint.results, text); !reason.empty())
        measured.not_measured.push_back(std::move(reason));
    }
    measured.joints.push_back(std::move(joint));
  }
  return measured;
}

Trace::Trace(const identification::Recording& rows, std::size_t measurement, std::size_t first,
             std::size_t last, std::size_t points)
    : rows_(rows),
      measurement_(measurement),
      first_(first),
      last_(last),
      block_((last - first + points - 1) / points) {
  const auto time = rows.column("time_s").subspan(first, last - first);
  if (time.size() > 1)
    mean_over_s_ =
        static_cast<double>(block_) * (time.back() - time.front()) / static_cast<double>(time.size() - 1);
}

std::vector<double> Trace::means(std::span<const double> values, double less) const {
  std::vector<double> result;
  for (std::size_t begin = first_; begin < last_; begin += block_) {
    const std::size_t end = std::min(last_, begin + block_);
    double sum = 0.0;
    for (std::size_t i = begin; i < end; ++i) sum += values[i] - less;
    result.push_back(sum / static_cast<double>(end - begin));
  }
  return result;
}

std::vector<double> Trace::time_s() const {
  const auto time = rows_.column("time_s");
  return means(time, time[first_]);
}
std::vector<double> Trace::displacement_rad() const {
  const auto position = rows_.column("position_rad");
  return means(position, position[first_]);
}
std::vector<double> Trace::column(std::string_view name) const { return means(rows_.column(name), 0.0); }

std::vector<Trace> traces(const MeasuredExperiment& experiment, const MeasuredJoint& joint,
                          std::size_t points) {
  std::vector<Trace> result;
  if (joint.rows.rows() == 0) return result;
  const double rest_s = experiment.setting("rest_s", 0.0);
  const auto time = joint.rows.column("time_s");
  const auto rows_before = [&time](double end_s) {
    return static_cast<std::size_t>(std::ranges::lower_bound(time, end_s) - time.begin());
  };
  std::vector<double> ends = experiment.finished_until_s;
  const std::size_t each = std::max<std::size_t>(1, points / std::max<std::size_t>(1, ends.size()));
  ends.push_back(std::numeric_limits<double>::infinity());
  const bool waits = rest_s > 0 && joint.rows.has("torque_command_Nm");
  const auto command_Nm = waits ? joint.rows.column("torque_command_Nm") : std::span<const double>();
  double begin_s = 0.0;
  for (std::size_t measurement = 0; measurement < ends.size(); ++measurement) {
    std::size_t first = rows_before(begin_s + rest_s + kTimeGrain_s);
    const std::size_t last = rows_before(ends[measurement] + kTimeGrain_s);
    while (waits && first < last && command_Nm[first] == 0) ++first;  // until the end of the joint's rest
    if (last > first) result.emplace_back(joint.rows, measurement, first, last, each);
    begin_s = ends[measurement];
  }
  return result;
}

}  // namespace youbot_bench
