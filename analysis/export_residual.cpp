#include "analysis/export_residual.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <stdexcept>

#include "hal/setup_error.h"
#include "runtime/program/build_info.h"
#include "runtime/recording/recording_file.h"

namespace analysis {
namespace {

using identification::gap::Signals;

/// "data/kp100.csv" → "data-kp100", and a number if that is taken.
std::string file_name(const std::string& recording, std::map<std::string, int>& taken) {
  std::string name = std::filesystem::path(recording).replace_extension().string();
  std::ranges::replace(name, '/', '-');
  const int before = taken[name]++;
  return name + (before > 0 ? fmt::format("-{}", before + 1) : "") + ".csv";
}

void close(runtime::RecordingFile& file, const std::filesystem::path& path) {
  file.close();
  if (const std::string problem = file.error(); !problem.empty())
    throw hal::SetupError(path.string(), "write the residual: " + problem, "free some space");
}

/// Quantities of one joint in a row, in the order of their columns.
constexpr std::array kJointColumns{"position_rad", "velocity_rad_per_s",  "acceleration_rad_per_s2",
                                   "torque_Nm",    "torque_predicted_Nm", "torque_residual_Nm",
                                   "moving"};

}  // namespace

std::vector<std::string> write_residuals(const model::effects::DriveModel& model,
                                         const identification::gap::MeasuredGap& data,
                                         const std::filesystem::path& directory) {
  std::map<std::string, int> taken;
  std::vector<std::string> names;
  for (const Signals& s : data.signals()) {
    const std::vector<double> predicted_Nm = identification::gap::predicted_torque_Nm(model, s);
    const std::filesystem::path path = directory / file_name(s.name, taken);
    runtime::RecordingFile file(path,
                                {{"rig", model.name.empty() ? "drive" : model.name},
                                 {"experiment", "residual"},
                                 {"sample_rate_Hz", fmt::format("{:.9g}", 1 / s.period_s)},
                                 {"band_Hz", fmt::format("{:.4g}", s.band_Hz)},
                                 {"torque", s.torque_is_command ? "commanded" : "measured"},
                                 {"software", runtime::build_version()}},
                                {{"time_s", 6},
                                 {"position_rad"},
                                 {"velocity_rad_per_s"},
                                 {"acceleration_rad_per_s2"},
                                 {s.torque_is_command ? "torque_command_Nm" : "torque_measured_Nm"},
                                 {"torque_predicted_Nm"},
                                 {"torque_residual_Nm"},
                                 {"moving", 0}});
    for (std::size_t i = 0; i < s.size(); ++i)
      file.append_row(std::array{s.time_s[i], s.position_rad[i], s.velocity_rad_per_s[i],
                                 s.acceleration_rad_per_s2[i], s.torque_Nm[i], predicted_Nm[i],
                                 s.torque_Nm[i] - predicted_Nm[i], s.moving[i]});
    close(file, path);
    names.push_back(path.filename().string());
  }
  return names;
}

std::vector<std::string> write_residuals(const std::string& robot, const control::ArmDescription& arm,
                                         const identification::robot_gap::MeasuredArm& data,
                                         const std::filesystem::path& directory) {
  std::map<std::string, int> taken;
  std::vector<std::string> names;
  std::vector<runtime::RecordingFile::Column> columns{{"time_s", 6}};
  for (std::size_t j = 0; j < arm.drives.size(); ++j)
    for (const char* const column : kJointColumns)
      columns.push_back({fmt::format("joint_{}_{}", j + 1, column),
                         column == kJointColumns.back() ? std::optional(0) : std::nullopt});
  for (std::size_t m = 0; m < data.motions().size(); ++m) {
    const identification::robot_gap::ArmMotion& motion = data.motions()[m];
    const identification::robot_gap::MeasuredArm::Rows rows = data.rows(arm, m);
    const std::filesystem::path path = directory / file_name(motion.name, taken);
    runtime::RecordingFile file(path,
                                {{"rig", robot.empty() ? "robot" : robot},
                                 {"experiment", "residual"},
                                 {"sample_rate_Hz", fmt::format("{:.9g}", 1 / motion.row_s())},
                                 {"band_Hz", fmt::format("{:.4g}", motion.band_Hz)},
                                 {"software", runtime::build_version()}},
                                columns);
    std::vector<double> row;
    for (std::size_t i = 0; i < rows.time_s.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      row.assign(1, rows.time_s[i]);
      for (Eigen::Index j = 0; j < rows.torque_Nm.rows(); ++j)
        row.insert(row.end(),
                   {rows.position_rad(j, at), rows.velocity_rad_per_s(j, at),
                    rows.acceleration_rad_per_s2(j, at), rows.torque_Nm(j, at), rows.predicted_Nm(j, at),
                    rows.torque_Nm(j, at) - rows.predicted_Nm(j, at), rows.moves(j, at)});
      file.append_row(row);
    }
    close(file, path);
    names.push_back(path.filename().string());
  }
  return names;
}

}  // namespace analysis
