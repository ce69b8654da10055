#include "analysis/robot.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <memory>
#include <utility>

#include "analysis/inputs.h"
#include "identification/fit/statistics.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/log.h"
#include "runtime/program/progress_line.h"
#include "runtime/recording/made_paths.h"
#include "runtime/recording/output_directory.h"
#include "runtime/recording/recording_reader.h"

namespace analysis {
namespace {

namespace fs = std::filesystem;
using identification::robot_gap::ArmRecording;

constexpr const char* kRobotFiles[] = {"model.toml", "report.html", "gap.json"};

std::string position_quantity(std::size_t joint) { return fmt::format("joint_{}_position_rad", joint + 1); }
std::string torque_quantity(std::size_t joint) { return fmt::format("joint_{}_torque_Nm", joint + 1); }

std::shared_ptr<const runtime::ColumnMap> column_map(const runtime::RobotFile& robot, const std::string& name,
                                                     const std::string& time) {
  auto map = std::make_shared<runtime::ColumnMap>();
  map->name = name;
  map->columns.push_back({"time_s", time});
  for (std::size_t j = 0; j < robot.arm.drives.size(); ++j) {
    const runtime::RobotFile::Columns& columns = robot.columns;
    map->columns.push_back({position_quantity(j), columns.position[j], columns.position_factor[j]});
    map->columns.push_back({torque_quantity(j), columns.torque[j], columns.torque_factor[j]});
  }
  return map;
}

/// Whether the table calls its time otherwise.
bool lacks_time(const runtime::RecordingError& error, const std::string& time) {
  return std::ranges::any_of(error.problems(), [&](const std::string& problem) {
    return problem.find("there is no column '" + time + "'") != std::string::npos;
  });
}

runtime::ReadRecording read_table(const runtime::RobotFile& robot, const std::string& robot_path,
                                  const fs::path& path) {
  const auto read = [&](const std::string& time) {
    return runtime::read_recording(path,
                                   runtime::ReadOptions{.columns = column_map(robot, robot_path, time)});
  };
  if (!robot.columns.time.empty()) return read(robot.columns.time);
  try {
    return read("t_s");
  } catch (const runtime::RecordingError& error) {
    if (!lacks_time(error, "t_s")) throw;
  }
  return read("time_s");
}

/// Straight lines would bridge it, and their ends would be accelerations.
void require_no_pause(const ArmRecording& recording, const fs::path& path) {
  constexpr double kBridgedPeriods = 5;  // as of the recording of a drive
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < recording.time_s.size(); ++i)
    steps_s.push_back(recording.time_s[i] - recording.time_s[i - 1]);
  if (steps_s.empty()) return;
  const double longest_s = kBridgedPeriods * identification::fit::median(steps_s);
  for (std::size_t i = 0; i < steps_s.size(); ++i)
    if (steps_s[i] > longest_s)
      throw runtime::ConfigError({fmt::format(
          "{}: after {:.3f} s there is a pause of {:.3g} s: split the file there, each part is a recording",
          path.string(), recording.time_s[i], steps_s[i])});
}

Eigen::MatrixXd gathered(const identification::Recording& recording, std::size_t joints,
                         std::string (*quantity)(std::size_t)) {
  Eigen::MatrixXd result(static_cast<Eigen::Index>(joints), static_cast<Eigen::Index>(recording.rows()));
  for (std::size_t j = 0; j < joints; ++j) {
    const auto values = recording.column(quantity(j));
    for (std::size_t i = 0; i < values.size(); ++i)
      result(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) = values[i];
  }
  return result;
}

}  // namespace

RobotRecordings read_robot_recordings(const runtime::RobotFile& robot, const RobotGapOptions& options) {
  const RecordingFiles files = recording_files(options.data, options.held_out);
  std::vector<std::string> problems;
  RobotRecordings result;
  const std::size_t joints = robot.arm.drives.size();
  for (std::size_t i = 0; i < files.names.size(); ++i) {
    const bool searched = i < files.data.size();
    const fs::path& path = searched ? files.data[i] : files.held_out[i - files.data.size()];
    try {
      runtime::ReadRecording read = read_table(robot, options.model.string(), path);
      // Columns that a robot file does not name are no mistake.
      std::erase_if(read.warnings, [](const std::string& text) {
        return text.find("were left out") != std::string::npos && text.find("columns") != std::string::npos;
      });
      result.warnings.insert(result.warnings.end(), read.warnings.begin(), read.warnings.end());
      const auto time_s = read.recording.column("time_s");
      ArmRecording recording{files.names[i],
                             {time_s.begin(), time_s.end()},
                             gathered(read.recording, joints, &position_quantity),
                             gathered(read.recording, joints, &torque_quantity)};
      require_no_pause(recording, path);
      (searched ? result.data : result.held_out).push_back(std::move(recording));
    } catch (const runtime::ConfigError& error) {
      problems.insert(problems.end(), error.problems().begin(), error.problems().end());
    }
  }
  if (!problems.empty()) throw runtime::ConfigError(std::move(problems));
  return result;
}

void explain_robot(const RobotGapOptions& options) {
  runtime::ProgressLine progress("youbot-gap", options.quiet);
  RobotFindings findings{.base = runtime::read_robot_file(options.model),
                         .base_path = options.model.string(),
                         .data = {},
                         .seed = options.seed,
                         .result = {}};
  RobotRecordings recordings = read_robot_recordings(findings.base, options);
  if (!recordings.warnings.empty()) progress.finish();
  for (const std::string& warning : recordings.warnings) spdlog::warn("{}", warning);
  runtime::require_no_results(options.out, {std::begin(kRobotFiles), std::end(kRobotFiles)});
  runtime::MadePaths made(runtime::make_output_directory(options.out));
  for (const ArmRecording& recording : recordings.data) findings.data.push_back(recording.name);
  const auto show = [&progress](std::string_view what, double done) { progress.show(what, done); };
  const identification::robot_gap::RobotOptions search{.band_Hz = findings.base.band_Hz,
                                                       .ripples_per_rev = findings.base.ripples_per_rev,
                                                       .seed = options.seed,
                                                       .progress = show};
  findings.result = identification::robot_gap::analyse(findings.base.arm, std::move(recordings.data),
                                                       std::move(recordings.held_out), search);
  made.keep();
  const std::string texts[] = {robot_model_text(findings, options.out), robot_report_html(findings),
                               robot_gap_json(findings)};
  for (std::size_t i = 0; i < std::size(kRobotFiles); ++i)
    runtime::write_whole_file(options.out / kRobotFiles[i], texts[i]);
  progress.finish();
  if (options.quiet) return;
  std::fputs(robot_summary_text(findings).c_str(), stdout);
  for (const char* const name : kRobotFiles) std::printf("written: %s\n", (options.out / name).c_str());
}

}  // namespace analysis
