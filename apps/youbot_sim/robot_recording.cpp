#include "apps/youbot_sim/robot_recording.h"

#include <limits>
#include <memory>
#include <utility>

#include "drivers/tmcl/gripper.h"
#include "hal/gripper.h"
#include "runtime/program/build_info.h"
#include "runtime/recording/record_rows.h"
#include "runtime/recording/started.h"

namespace youbot_sim {
namespace {

using drivers::tmcl::ControllerMode;

constexpr double kMetresPerMicrostep =
    hal::kGripperTravel_m / drivers::tmcl::kGripperBars / drivers::tmcl::kGripperTravel;

std::string name_of(const sim::bus::YoubotBus& robot, std::size_t joint) {
  const std::size_t wheels = robot.has_base() ? 4 : 0;
  if (joint < wheels) return "wheel_" + std::to_string(joint + 1);
  const std::size_t arm_joint = joint - wheels;
  return (arm_joint < 5 ? "arm_" : "arm2_") + std::to_string(arm_joint % 5 + 1);
}

/// A record and the layout of its robot.
struct RobotRow {
  const RobotRecord& record;
  const std::vector<std::string>& joints;  ///< their names
  const sim::bus::YoubotBus& robot;
  bool coupled;  ///< a base that carries one arm
};
template <typename Column>
void visit(const RobotRow& row, Column&& column) {
  const RobotRecord& r = row.record;
  column("time_s", "", std::chrono::duration<double>(r.time).count(), 3);
  for (std::size_t i = 0; i < row.joints.size(); ++i) {
    const char* const name = row.joints[i].c_str();
    column(name, "_mode", r.joints[i].mode, 0);
    column(name, "_target", r.joints[i].target, 6);
    column(name, "_position_rad", r.joints[i].position_rad, 7);
    column(name, "_encoder_rad", r.joints[i].encoder_rad, 7);
  }
  const auto vector = [&column](const char* name, const std::array<const char*, 3>& ends,
                                const std::array<double, 3>& numbers) {
    for (std::size_t i = 0; i < 3; ++i) column(name, ends[i], numbers[i], 6);
  };
  if (row.robot.has_base()) vector("base", {"_x_m", "_y_m", "_yaw_rad"}, r.base_W);
  if (row.coupled) {
    vector("true_tip", {"_x_m", "_y_m", "_z_m"}, r.tip_p_WT_m);
    vector("contact_force", {"_x_N", "_y_N", "_z_N"}, r.contact_force_W_N);
  }
  if (row.robot.gripper_count() > 0) column("gripper_opening_m", "", r.gripper_opening_m[0], 6);
  if (row.robot.gripper_count() > 1) column("gripper2_opening_m", "", r.gripper_opening_m[1], 6);
}

std::vector<runtime::Recording<RobotRecord>::Table> open(const std::filesystem::path& path,
                                                         sim::bus::YoubotBus& robot,
                                                         runtime::MadePaths& made) {
  std::vector<std::string> joints;
  for (std::size_t i = 0; i < robot.joint_count(); ++i) joints.push_back(name_of(robot, i));
  const bool coupled = robot.manipulator() != nullptr;
  auto file = std::make_unique<runtime::RecordingFile>(
      path,
      std::vector<runtime::RecordingFile::Comment>{
          {"rig", "youbot-sim"},
          {"sample_rate_Hz", "1000"},
          {"mode", "-1 no power, 0 stopped, 1 position, 2 velocity, 5 PWM (target not given), 6 current"},
          runtime::started_now(),
          {"software", runtime::build_version()}},
      runtime::columns_of(RobotRow{{}, joints, robot, coupled}));
  made.add(path);
  std::vector<runtime::Recording<RobotRecord>::Table> tables;
  tables.push_back(
      {std::move(file), [joints, &robot, coupled](runtime::RecordingFile& to, const RobotRecord& record) {
         runtime::append_record(to, RobotRow{record, joints, robot, coupled});
       }});
  return tables;
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
    default: break;  // stopped: zero speed
  }
  return record;
}

std::array<double, 3> numbers(const Eigen::Vector3d& v) noexcept { return {v.x(), v.y(), v.z()}; }

}  // namespace

RobotRecording::RobotRecording(const std::filesystem::path& path, sim::bus::YoubotBus& robot, bool wait)
    : robot_(robot),
      wait_(wait),
      recording_(open(path, robot, made_), [this](const RobotRecord&) { made_.keep(); }) {
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
  if (wait_) recording_.wait_for_room();
  recording_.add(record);
}

void RobotRecording::close() noexcept {
  robot_.after_each_period(nullptr);
  recording_.close();
}

}  // namespace youbot_sim
