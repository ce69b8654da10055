#include "apps/youbotd/teleop_recording.h"

#include <array>
#include <cstdio>
#include <exception>
#include <span>
#include <system_error>
#include <utility>

#include "apps/common/build_info.h"
#include "apps/youbotd/workspace_comments.h"

namespace youbotd {
namespace {

using Column = apps::RecordingFile::Column;

/// 16 s at 1 kHz: longer than a disk stalls.
constexpr std::size_t kRingCapacity = 16384;
constexpr const char* kFile = "teleoperation.csv";
/// Where rows may have `nan`, and why.
constexpr const char* kNoTruth =
    "true_tip_x_m,true_tip_y_m,true_tip_z_m,contact_force_x_N,contact_force_y_N,contact_force_z_N: "
    "only a simulation knows";
constexpr const char* kNoOpening = "gripper_opening_m: the gripper was told nothing";

/// Visits a record as names and values, so that a column and its number stand in one place. A name comes in
/// two parts, as putting it together takes longer than writing the number.
template <typename Visit>
void visit(const TeleopRecord& r, Visit&& value) {
  const auto plain = [&value](const char* name, double number, int decimals) {
    value(name, "", number, decimals);
  };
  const auto vector = [&value](const char* name, const std::array<const char*, 3>& ends, const auto& numbers,
                               int decimals) {
    for (std::size_t i = 0; i < 3; ++i) value(name, ends[i], numbers[i], decimals);
  };
  const auto rotation = [&value](const char* name, const auto& numbers) {
    constexpr std::array<const char*, 4> kParts{"_qw", "_qx", "_qy", "_qz"};
    for (std::size_t i = 0; i < 4; ++i) value(name, kParts[i], numbers[i], 6);
  };
  constexpr std::array<const char*, 3> kMetres{"_x_m", "_y_m", "_z_m"};
  constexpr std::array<const char*, 3> kNewtons{"_x_N", "_y_N", "_z_N"};
  constexpr std::array<const char*, TeleopRecord::kJoints> kJointNames{
      "wheel_1", "wheel_2", "wheel_3", "wheel_4", "arm_1", "arm_2", "arm_3", "arm_4", "arm_5"};
  plain("time_s", std::chrono::duration<double>(r.time).count(), 6);
  plain("phase", static_cast<double>(r.phase), 0);
  plain("rate_control", r.rate_control, 0);
  plain("clutched", r.clutched, 0);
  plain("limited", r.limited, 0);
  plain("protecting", r.protecting, 0);
  vector("setpoint", kMetres, r.setpoint_p_WT_m, 6);
  rotation("setpoint", r.setpoint_q_WT);
  vector("tip", kMetres, r.tip_p_WT_m, 6);
  rotation("tip", r.tip_q_WT);
  vector("true_tip", kMetres, r.true_tip_p_WT_m, 6);
  vector("contact_force", kNewtons, r.contact_force_W_N, 4);
  vector("base", {"_x_m", "_y_m", "_yaw_rad"}, r.base_W, 6);
  plain("stiffness_N_per_m", r.stiffness_N_per_m, 2);
  vector("spring", kNewtons, r.spring_W_N, 4);
  vector("wrench_force", kNewtons, std::array{r.wrench_W[0], r.wrench_W[1], r.wrench_W[2]}, 4);
  vector("wrench_moment", {"_x_Nm", "_y_Nm", "_z_Nm"},
         std::array{r.wrench_W[3], r.wrench_W[4], r.wrench_W[5]}, 4);
  vector("grip", kMetres, r.grip_p_HD_m, 6);
  rotation("grip", r.grip_q_HD);
  vector("grip_velocity", {"_x_m_per_s", "_y_m_per_s", "_z_m_per_s"}, r.grip_v_HD_m_per_s, 5);
  vector("grip_force_command", kNewtons, r.grip_force_H_N, 4);
  vector("grip_force_held", kNewtons, r.held_force_H_N, 4);
  plain("grip_age_s", r.grip_age_s, 6);
  plain("buttons", static_cast<double>(r.buttons), 0);
  plain("tank_J", r.tank_J, 6);
  plain("withheld_N", r.withheld_N, 4);
  plain("port_energy_J", r.port_energy_J, 6);
  plain("gripper_opening_m", r.gripper_opening_m, 4);
  plain("arm_mode", static_cast<double>(r.arm_mode), 0);
  for (std::size_t i = 0; i < TeleopRecord::kJoints; ++i) {
    const bool wheel = i < 4;
    value(kJointNames[i], wheel ? "_torque_command_Nm" : "_command", r.command[i], 6);
    value(kJointNames[i], "_torque_measured_Nm", r.torque_measured_Nm[i], 6);
    value(kJointNames[i], "_position_rad", r.position_rad[i], 7);
  }
  plain("wake_up_us", std::chrono::duration<double, std::micro>(r.wake_up).count(), 3);
  plain("step_us", std::chrono::duration<double, std::micro>(r.step).count(), 3);
}

}  // namespace

std::vector<Column> teleop_columns() {
  std::vector<Column> columns;
  visit(TeleopRecord{}, [&columns](const char* name, const char* end, double, int decimals) {
    columns.push_back({std::string(name) + end, decimals});
  });
  return columns;
}

void append_teleop(apps::RecordingFile& file, const TeleopRecord& record) {
  std::array<double, 128> row;
  std::size_t width = 0;
  visit(record, [&](const char*, const char*, double value, int) { row[width++] = value; });
  file.append_row(std::span(row).first(width));
}

TeleopRecording::TeleopRecording(const std::filesystem::path& directory, const apps::RecordingConfig& config,
                                 std::chrono::nanoseconds period, bool simulated,
                                 const control::Workspace& workspace)
    : new_recording_(directory, config, setup_problems_),
      file_(open(period, simulated, workspace)),
      way_({{"base"}, {"set-point", report::Style::kDashed}, {"tip"}}, /*from_the_side=*/true, workspace),
      report_(directory / "report.html"),
      recorder_(
          kRingCapacity, [this](const TeleopRecord& record) { write(record); }, [this] { file_->flush(); }) {}

std::unique_ptr<apps::RecordingFile> TeleopRecording::open(std::chrono::nanoseconds period, bool simulated,
                                                           const control::Workspace& workspace) {
  std::array<char, 32> rate_Hz{};
  std::snprintf(rate_Hz.data(), rate_Hz.size(), "%g", 1 / std::chrono::duration<double>(period).count());
  std::vector<apps::RecordingFile::Comment> comments{{"rig", "base+arm"},
                                                     {"experiment", "teleoperation"},
                                                     {"sample_rate_Hz", rate_Hz.data()},
                                                     {"not_measured", kNoOpening},
                                                     {"software", apps::build_version()}};
  add_workspace(workspace, comments);
  if (!simulated) comments.push_back({"not_measured", kNoTruth});
  return new_recording_.open("teleoperation", comments, teleop_columns());
}

bool TeleopRecording::holds_recording(const std::filesystem::path& directory) {
  // A directory that cannot be looked into cannot be written to either, and making files in it says why.
  std::error_code unknown;
  return std::filesystem::exists(directory / "config.toml", unknown) ||
         std::filesystem::exists(directory / kFile, unknown);
}

void TeleopRecording::write(const TeleopRecord& record) {
  new_recording_.keep();
  append_teleop(*file_, record);
  way_.add({{record.base_W[0], record.base_W[1], 0},
            Eigen::Vector3d(record.setpoint_p_WT_m.data()),
            Eigen::Vector3d(record.tip_p_WT_m.data())},
           record.limited);
}

void TeleopRecording::close() noexcept {
  recorder_.stop();
  file_->close();
  if (recorder_.statistics().pushed == 0) return;  // nothing is left of it
  try {
    way_.write(report_);
  } catch (const std::exception& failure) {
    report_problem_ = failure.what();
  }
}

std::uint64_t TeleopRecording::cycles_recorded() const noexcept { return file_->rows_written(); }

std::uint64_t TeleopRecording::cycles_lost() const noexcept {
  const apps::RecorderStatistics statistics = recorder_.statistics();
  return statistics.pushed + statistics.dropped - cycles_recorded();
}

RecordingState TeleopRecording::state() const {
  return {.cycles_lost = recorder_.statistics().dropped + file_->rows_lost(), .problems = problems()};
}

std::vector<std::string> TeleopRecording::problems() const {
  std::vector<std::string> problems = setup_problems_;
  if (!file_->error().empty()) problems.push_back(file_->error());
  if (!report_problem_.empty()) problems.push_back(report_problem_);
  for (std::string& problem : recorder_.problems()) problems.push_back(std::move(problem));
  return problems;
}

}  // namespace youbotd
