#include "apps/youbotd/base_recording.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <system_error>
#include <utility>

#include "apps/common/build_info.h"
#include "apps/youbotd/workspace_comments.h"
#include "hal/seconds.h"

namespace youbotd {
namespace {

using hal::microseconds;
using hal::seconds;

/// 16 s at 1 kHz: longer than a disk stalls.
constexpr std::size_t kRingCapacity = 16384;

}  // namespace

std::vector<apps::RecordingFile::Column> cycle_columns() {
  std::vector<apps::RecordingFile::Column> columns{{"time_s", 6}, {"phase", 0}, {"limited", 0}};
  for (const char* pose : {"reference", "odometry", "truth"})
    for (const char* unit : {"_x_m", "_y_m", "_yaw_rad"}) columns.push_back({std::string(pose) + unit, 6});
  for (const char* name : {"force_x_N", "force_y_N", "moment_Nm"}) columns.push_back({name, 4});
  for (std::size_t i = 1; i <= kWheels; ++i) {
    const std::string wheel = "wheel_" + std::to_string(i);
    columns.push_back({wheel + "_torque_command_Nm", 6});
    columns.push_back({wheel + "_torque_measured_Nm", 6});
    columns.push_back({wheel + "_position_rad", 7});
    columns.push_back({wheel + "_velocity_rad_per_s", 6});
    columns.push_back({wheel + "_reported_velocity_rad_per_s", 6});
  }
  columns.push_back({"wake_up_us", 3});
  columns.push_back({"step_us", 3});
  return columns;
}

void append_cycle(apps::RecordingFile& file, const CycleRecord& record) {
  std::array<double, 3 + 12 + 5 * kWheels + 2> row;
  auto out = row.begin();
  *out++ = seconds(record.time);
  *out++ = static_cast<double>(record.phase);
  *out++ = record.limited;
  for (const auto* values : {&record.reference_W, &record.odometry_W, &record.truth_W, &record.wrench_B})
    out = std::copy(values->begin(), values->end(), out);
  for (std::size_t i = 0; i < kWheels; ++i) {
    *out++ = record.torque_command_Nm[i];
    *out++ = record.torque_measured_Nm[i];
    *out++ = record.position_rad[i];
    *out++ = record.velocity_rad_per_s[i];
    *out++ = record.reported_velocity_rad_per_s[i];
  }
  *out++ = microseconds(record.wake_up);
  *out++ = microseconds(record.step);
  file.append_row(row);
}

BaseRecording::BaseRecording(const Description& description)
    : new_recording_(description.directory, description.config, setup_problems_),
      files_(open_files(description)),
      way_({{"reference", report::Style::kDashed}, {"base"}}, /*from_the_side=*/false, description.workspace),
      report_(description.directory / "report.html"),
      recorder_(
          kRingCapacity, [this](const CycleRecord& record) { write(record); }, [this] { flush(); }) {}

BaseRecording::Files BaseRecording::open_files(const Description& description) {
  Files files(kWheels + 1);
  char rate_Hz[32];
  std::snprintf(rate_Hz, sizeof rate_Hz, "%g", 1 / seconds(description.period));
  const auto open = [&](const std::string& rig, const std::vector<apps::RecordingFile::Column>& columns) {
    std::vector<apps::RecordingFile::Comment> comments{
        {"rig", rig},
        {"experiment", description.experiment},
        {"sample_rate_Hz", rate_Hz},
        {"friction_compensation", description.friction_compensation ? "true" : "false"},
        {"software", apps::build_version()}};
    add_workspace(description.workspace, comments);
    return new_recording_.open(rig, comments, columns);
  };
  for (std::size_t i = 0; i < kWheels; ++i)
    files[i] = open("wheel-" + std::to_string(i + 1), {{"time_s", 6},
                                                       {"torque_command_Nm", 6},
                                                       {"torque_measured_Nm", 6},
                                                       {"position_rad", 7},
                                                       {"velocity_rad_per_s", 6}});
  files[kWheels] = open("base", cycle_columns());
  return files;
}

bool BaseRecording::holds_recording(const std::filesystem::path& directory) {
  // A directory that cannot be looked into cannot be written to either, and making files in it says why.
  std::error_code unknown;
  for (const char* name : {"config.toml", "base.csv", "wheel-1.csv"})
    if (std::filesystem::exists(directory / name, unknown)) return true;
  return false;
}

void BaseRecording::write(const CycleRecord& record) {
  new_recording_.keep();
  for (std::size_t i = 0; i < kWheels; ++i)
    files_[i]->append_row(std::array{seconds(record.time), record.torque_command_Nm[i],
                                     record.torque_measured_Nm[i], record.position_rad[i],
                                     record.velocity_rad_per_s[i]});
  append_cycle(*files_[kWheels], record);
  way_.add(
      {{record.reference_W[0], record.reference_W[1], 0}, {record.odometry_W[0], record.odometry_W[1], 0}},
      record.limited);
}

void BaseRecording::flush() {
  for (const auto& file : files_) file->flush();
}

void BaseRecording::close() noexcept {
  recorder_.stop();
  for (const auto& file : files_) file->close();
  if (recorder_.statistics().pushed == 0) return;  // nothing is left of it
  try {
    way_.write(report_);
  } catch (const std::exception& failure) {
    report_problem_ = failure.what();
  }
}

std::uint64_t BaseRecording::cycles_recorded() const noexcept {
  std::uint64_t least = recorder_.statistics().pushed;
  for (const auto& file : files_) least = std::min(least, file->rows_written());
  return least;
}

std::uint64_t BaseRecording::cycles_lost() const noexcept {
  const apps::RecorderStatistics statistics = recorder_.statistics();
  return statistics.pushed + statistics.dropped - cycles_recorded();
}

RecordingState BaseRecording::state() const {
  std::uint64_t most = 0;
  for (const auto& file : files_) most = std::max(most, file->rows_lost());
  return {.cycles_lost = recorder_.statistics().dropped + most, .problems = problems()};
}

std::vector<std::string> BaseRecording::problems() const {
  std::vector<std::string> problems = setup_problems_;
  for (const auto& file : files_)
    if (!file->error().empty()) problems.push_back(file->error());
  if (!report_problem_.empty()) problems.push_back(report_problem_);
  for (std::string& problem : recorder_.problems()) problems.push_back(std::move(problem));
  return problems;
}

}  // namespace youbotd
