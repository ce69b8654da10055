#include "apps/youbot_sim/robot_recording.h"

#include <limits>
#include <span>
#include <utility>

#include "apps/common/build_info.h"
#include "drivers/tmcl/gripper.h"
#include "hal/gripper.h"

namespace youbot_sim {
namespace {

using drivers::tmcl::ControllerMode;
using Column = apps::RecordingFile::Column;

/// 16 s: longer than a disk stalls.
constexpr std::size_t kRingCapacity = 16384;
constexpr double kMetresPerMicrostep =
    hal::kGripperTravel_m / drivers::tmcl::kGripperBars / drivers::tmcl::kGripperTravel;

std::string name_of(const sim::bus::YoubotBus& robot, std::size_t joint) {
  const std::size_t wheels = robot.has_base() ? 4 : 0;
  if (joint < wheels) return "wheel_" + std::to_string(joint + 1);
  const std::size_t arm_joint = joint - wheels;
  return (arm_joint < 5 ? "arm_" : "arm2_") + std::to_string(arm_joint % 5 + 1);
}

/// Visits the values of a record as names and numbers, so that both stand in one place.
template <typename Visit>
void visit(const sim::bus::YoubotBus& robot, bool coupled, const RobotRecord& record, Visit&& value) {
  value("", "time_s", std::chrono::duration<double>(record.time).count(), 3);
  for (std::size_t i = 0; i < robot.joint_count(); ++i) {
    value(i, "_mode", record.joints[i].mode, 0);
    value(i, "_target", record.joints[i].target, 6);
    value(i, "_position_rad", record.joints[i].position_rad, 7);
    value(i, "_encoder_rad", record.joints[i].encoder_rad, 7);
  }
  const auto vector = [&value](const char* name, const std::array<const char*, 3>& ends,
                               const std::array<double, 3>& numbers) {
    for (std::size_t i = 0; i < 3; ++i) value(name, ends[i], numbers[i], 6);
  };
  if (robot.has_base()) vector("base", {"_x_m", "_y_m", "_yaw_rad"}, record.base_W);
  if (coupled) {
    vector("true_tip", {"_x_m", "_y_m", "_z_m"}, record.tip_p_WT_m);
    vector("contact_force", {"_x_N", "_y_N", "_z_N"}, record.contact_force_W_N);
  }
  if (robot.gripper_count() > 0) value("", "gripper_opening_m", record.gripper_opening_m[0], 6);
  if (robot.gripper_count() > 1) value("", "gripper2_opening_m", record.gripper_opening_m[1], 6);
}

std::vector<Column> columns(sim::bus::YoubotBus& robot) {
  struct Names {
    const sim::bus::YoubotBus& robot;
    std::vector<Column> columns{};
    void operator()(const char* name, const char* end, double /*value*/, int decimals) {
      columns.push_back({std::string(name) + end, decimals});
    }
    void operator()(std::size_t joint, const char* end, double /*value*/, int decimals) {
      columns.push_back({name_of(robot, joint) + end, decimals});
    }
  } names{robot};
  visit(robot, robot.manipulator() != nullptr, {}, names);
  return names.columns;
}

void append(apps::RecordingFile& file, sim::bus::YoubotBus& robot, const RobotRecord& record) {
  std::array<double, 128> row;
  std::size_t width = 0;
  visit(robot, robot.manipulator() != nullptr, record,
        [&](auto, const char*, double number, int) { row[width++] = number; });
  file.append_row(std::span(row).first(width));
}

RobotRecord::Joint joint_of(sim::bus::YoubotBus& robot, std::size_t joint) noexcept {
  const sim::bus::TmcmBoard& board = robot.board(joint);
  const sim::bus::MotorUnits& units = board.units();
  RobotRecord::Joint record{.mode = -1,
                            .position_rad = robot.position_rad(joint),
                            .encoder_rad = units.position_rad(board.input().position_ticks)};
  if (!board.followed()) return record;
  const auto [mode, value] = *board.followed();
  record.mode = static_cast<double>(mode);
  switch (mode) {
    case ControllerMode::kPosition: record.target = units.position_rad(value); break;
    case ControllerMode::kVelocity: record.target = units.velocity_rad_per_s(value); break;
    case ControllerMode::kCurrent: record.target = units.torque_Nm(value); break;
    case ControllerMode::kPwm: record.target = std::numeric_limits<double>::quiet_NaN(); break;
    default: break;  // stopped: no speed
  }
  return record;
}

std::array<double, 3> numbers(const Eigen::Vector3d& v) noexcept { return {v.x(), v.y(), v.z()}; }

}  // namespace

RobotRecording::RobotRecording(const std::filesystem::path& path, sim::bus::YoubotBus& robot, bool wait)
    : robot_(robot),
      wait_(wait),
      file_(path,
            {{"rig", "youbot-sim"},
             {"sample_rate_Hz", "1000"},
             {"mode", "-1 no power, 0 stopped, 1 position, 2 velocity, 5 PWM (target not given), 6 current"},
             {"made_by", apps::build_version()}},
            columns(robot)),
      made_({path}),
      recorder_(
          kRingCapacity,
          [this](const RobotRecord& record) {
            made_.keep();
            append(file_, robot_, record);
          },
          [this] { file_.flush(); }) {
  robot_.after_each_period([this] { take(); });
}

void RobotRecording::take() noexcept {
  RobotRecord record{.time = robot_.wire().now()};
  for (std::size_t i = 0; i < robot_.joint_count(); ++i) record.joints[i] = joint_of(robot_, i);
  if (robot_.has_base()) record.base_W = {robot_.pose().x_m, robot_.pose().y_m, robot_.pose().yaw_rad};
  if (const sim::MobileManipulator* whole = robot_.manipulator()) {
    record.tip_p_WT_m = numbers(whole->X_WT().translation());
    record.contact_force_W_N = numbers(whole->contact_force_W_N());
  }
  for (std::size_t arm = 0; arm < robot_.gripper_count(); ++arm)
    record.gripper_opening_m[arm] =
        kMetresPerMicrostep * (robot_.gripper(arm).opening(0) + robot_.gripper(arm).opening(1));
  if (wait_) recorder_.wait_for_room();
  recorder_.push(record);
}

void RobotRecording::close() noexcept {
  robot_.after_each_period(nullptr);
  recorder_.stop();
  file_.close();
}

std::vector<std::string> RobotRecording::problems() const {
  std::vector<std::string> problems = recorder_.problems();
  if (std::string error = file_.error(); !error.empty()) problems.push_back(std::move(error));
  return problems;
}

}  // namespace youbot_sim
