#include "operation/live_channels.h"

#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "control/robot_model.h"
#include "control/teleoperation.h"
#include "runtime/mcap/ros_messages.h"
#include "runtime/recording/record_rows.h"

namespace operation {
namespace {

namespace ros = live::ros;
using live::Channel;
using runtime::mcap::JointState;
using runtime::mcap::Time;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kWorld = "world";
constexpr const char* kBase = "base_footprint";

Channel channel(const char* topic, const ros::Type& type) {
  return {.topic = topic,
          .encoding = "cdr",
          .schema_name = std::string(type.name),
          .schema = type.definition(),
          .schema_encoding = "ros2msg",
          .type_hash = std::string(type.hash)};
}

Channel joints_channel(const char* topic) {
  return {.topic = topic,
          .encoding = "cdr",
          .schema_name = std::string(runtime::mcap::kJointStateType),
          .schema = std::string(runtime::mcap::kJointStateDefinition),
          .schema_encoding = "ros2msg",
          .type_hash = std::string(ros::kJointStateHash)};
}

JointState joints(std::uint64_t time_ns, std::size_t count) {
  JointState state;
  state.stamp = Time::from_ns(time_ns);
  for (std::size_t i = 0; i < count; ++i)
    state.name.push_back(i < kWheels ? "wheel_" + std::to_string(i + 1)
                                     : "arm_" + std::to_string(i - kWheels + 1));
  return state;
}

template <typename Values>
std::vector<double> list(const Values& values) {
  return {values.begin(), values.end()};
}

Eigen::Vector3d vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

Eigen::Isometry3d planar(const std::array<double, 3>& pose) {
  return Eigen::Translation3d(pose[0], pose[1], 0) *
         Eigen::Isometry3d(Eigen::AngleAxisd(pose[2], Eigen::Vector3d::UnitZ()));
}

/// Not finite before the first cycle with a pose: at the origin then.
Eigen::Isometry3d isometry(const std::array<double, 3>& p, const std::array<double, 4>& q) {
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  if (!vector(p).allFinite() || !(rotation.norm() > 0.5)) return Eigen::Isometry3d::Identity();
  return Eigen::Translation3d(vector(p)) * rotation.normalized();
}

std::string text(const nlohmann::json& value) {
  return value.is_string() ? value.get<std::string>()
                           : value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

LiveChannels::LiveChannels(live::Outlet& outlet, bool teleoperated, const control::BaseGeometry& geometry)
    : outlet_(outlet), transforms_(control::youbot_urdf()), covariance_(geometry) {
  const auto columns =
      teleoperated ? runtime::columns_of(TeleopRecord{}) : runtime::columns_of(CycleRecord{});
  for (const auto& column : columns) columns_.push_back(column.name);
  record_ = outlet_.add({.topic = "/youbot/record",
                         .encoding = "cdr",
                         .schema_name = std::string(runtime::mcap::kRecordType),
                         .schema = runtime::mcap::record_definition(columns_),
                         .schema_encoding = "ros2msg"});
  status_ = outlet_.add({.topic = "/youbot/status",
                         .encoding = "json",
                         .schema_name = "youbotd-status/1",
                         .schema = R"({"type": "object"})",
                         .schema_encoding = "jsonschema",
                         .latched = true});
  joint_states_ = outlet_.add(joints_channel("/joint_states"));
  joint_commands_ = outlet_.add(joints_channel("/joint_commands"));
  odometry_ = outlet_.add(channel("/odom", ros::kOdometry));
  frames_ = outlet_.add(channel("/tf", ros::kTransforms));
  diagnostics_ = outlet_.add(channel("/diagnostics", ros::kDiagnosticArray));
  if (teleoperated) {
    end_effector_ = outlet_.add(channel("/end_effector/pose", ros::kPoseStamped));
    setpoint_ = outlet_.add(channel("/end_effector/setpoint", ros::kPoseStamped));
    wrench_ = outlet_.add(channel("/end_effector/wrench", ros::kWrenchStamped));
    felt_force_ = outlet_.add(channel("/haptic/force", ros::kWrenchStamped));
  }
  auto description = channel("/robot_description", ros::kString);
  description.latched = true;
  const std::size_t robot_description = outlet_.add(std::move(description));
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  send(robot_description, static_cast<std::uint64_t>(std::chrono::nanoseconds(now).count()),
       [](runtime::mcap::CdrWriter& cdr) { ros::write_string(cdr, control::youbot_urdf()); });
}

template <typename Write>
void LiveChannels::send(std::size_t channel, std::uint64_t time_ns, const Write& write) {
  if (!outlet_.wanted(channel)) return;
  cdr_.clear();
  write(cdr_);
  outlet_.publish(channel, time_ns, cdr_.payload());
}

template <typename Record>
void LiveChannels::publish_record(std::uint64_t time_ns, const Record& record) {
  send(record_, time_ns, [&](auto& cdr) {
    visit(record, [&](const char*, const char*, double value, int) { cdr.number(value); });
  });
}

void LiveChannels::publish(const LiveSample& sample) {
  if (!sample.running) {
    before_.reset();
    covariance_.reset();
  }
  running_ = sample.running;
  std::visit([&](const auto& record) { publish(sample.time_ns, record); }, sample.record);
}

void LiveChannels::publish(std::uint64_t time_ns, const CycleRecord& record) {
  publish_record(time_ns, record);
  send(joint_states_, time_ns, [&](auto& cdr) {
    JointState state = joints(time_ns, kWheels);
    state.position_rad = list(record.position_rad);
    state.velocity_rad_per_s = list(record.velocity_rad_per_s);
    state.effort_Nm = list(record.torque_measured_Nm);
    write(cdr, state);
  });
  if (!running_) return;
  send(joint_commands_, time_ns, [&](auto& cdr) {
    JointState state = joints(time_ns, kWheels);
    state.effort_Nm = list(record.torque_command_Nm);
    write(cdr, state);
  });
  publish_odometry(time_ns, record.odometry_W, record.position_rad.data());
  publish_transforms(time_ns, record.odometry_W, nullptr);
}

void LiveChannels::publish(std::uint64_t time_ns, const TeleopRecord& record) {
  publish_record(time_ns, record);
  send(joint_states_, time_ns, [&](auto& cdr) {
    JointState state = joints(time_ns, TeleopRecord::kJoints);
    state.position_rad = list(record.position_rad);
    state.effort_Nm = list(record.torque_measured_Nm);
    write(cdr, state);
  });
  if (!running_) return;
  send(joint_commands_, time_ns, [&](auto& cdr) {
    JointState state = joints(time_ns, TeleopRecord::kJoints);
    state.effort_Nm = list(record.command);
    // A joint that is commanded a position has no commanded torque, and the reverse.
    if (record.arm_mode == static_cast<std::uint8_t>(control::TeleopOutput::Arm::kPosition)) {
      state.position_rad.assign(TeleopRecord::kJoints, kNaN);
      for (std::size_t i = kWheels; i < TeleopRecord::kJoints; ++i)
        state.position_rad[i] = std::exchange(state.effort_Nm[i], kNaN);
    }
    write(cdr, state);
  });
  const ros::Header in_world{Time::from_ns(time_ns), kWorld};
  send(end_effector_, time_ns, [&](auto& cdr) {
    ros::write_pose_stamped(cdr, in_world, isometry(record.tip_p_WT_m, record.tip_q_WT));
  });
  send(setpoint_, time_ns, [&](auto& cdr) {
    ros::write_pose_stamped(cdr, in_world, isometry(record.setpoint_p_WT_m, record.setpoint_q_WT));
  });
  const auto& wrench = record.wrench_W;
  send(wrench_, time_ns, [&](auto& cdr) {
    ros::write_wrench_stamped(cdr, in_world, {wrench[0], wrench[1], wrench[2]},
                              {wrench[3], wrench[4], wrench[5]});
  });
  send(felt_force_, time_ns, [&](auto& cdr) {
    ros::write_wrench_stamped(cdr, {Time::from_ns(time_ns), "haptic_device"}, vector(record.held_force_H_N),
                              Eigen::Vector3d::Zero());
  });
  publish_odometry(time_ns, record.base_W, record.position_rad.data());
  publish_transforms(time_ns, record.base_W, record.position_rad.data() + kWheels);
}

/// The velocity is the mean since the sample before.
void LiveChannels::publish_odometry(std::uint64_t time_ns, const std::array<double, 3>& base_W,
                                    const double* wheel_rad) {
  ros::Odometry odometry{
      .header = {Time::from_ns(time_ns), kWorld}, .child_frame_id = kBase, .pose = planar(base_W)};
  covariance_.step(Eigen::Map<const control::WheelVector>(wheel_rad), {base_W[0], base_W[1], base_W[2]});
  // A filter cannot use a pose without any variance.
  constexpr double kLeastVariance = 1e-6;  // a millimetre, a milliradian
  odometry.pose_covariance = covariance_.pose_W() + kLeastVariance * Eigen::Matrix3d::Identity();
  if (before_ && time_ns > before_->time_ns) {
    const double elapsed_s = 1e-9 * static_cast<double>(time_ns - before_->time_ns);
    const Eigen::Vector3d velocity_W = (vector(base_W) - vector(before_->base_W)) / elapsed_s;
    odometry.velocity_m_per_s =
        odometry.pose.linear().transpose() * Eigen::Vector3d(velocity_W.x(), velocity_W.y(), 0);
    odometry.rate_rad_per_s.z() = velocity_W.z();
    odometry.twist_covariance = covariance_.twist_B(elapsed_s);
  }
  before_ = Motion{time_ns, base_W};
  send(odometry_, time_ns, [&](auto& cdr) { write(cdr, odometry); });
}

void LiveChannels::publish_transforms(std::uint64_t time_ns, const std::array<double, 3>& base_W,
                                      const double* arm_rad) {
  send(frames_, time_ns, [&](auto& cdr) {
    positions_["base_x"] = base_W[0];
    positions_["base_y"] = base_W[1];
    positions_["base_yaw"] = base_W[2];
    for (int i = 0; arm_rad != nullptr && i < control::kArmJoints; ++i)
      positions_["arm_joint_" + std::to_string(i + 1)] = arm_rad[i];
    ros::write_transforms(cdr, Time::from_ns(time_ns), transforms_.at(positions_));
  });
}

void LiveChannels::publish_status(std::uint64_t time_ns, const nlohmann::json& status) {
  if (outlet_.wanted(status_)) outlet_.publish(status_, time_ns, text(status));
  send(diagnostics_, time_ns, [&](auto& cdr) {
    using Level = ros::Diagnostic::Level;
    const std::string fault = status.value("fault", "");
    ros::Diagnostic whole{.level = fault.empty() ? Level::kOk : Level::kError,
                          .name = "youbotd",
                          .message = fault.empty() ? status.value("phase", "") : fault,
                          .hardware_id = status.value("robot", "")};
    for (const auto& [key, value] : status.items())
      if (value.is_primitive()) whole.values.emplace_back(key, text(value));
    std::vector<ros::Diagnostic> all{std::move(whole)};
    for (const auto& line : status.value("robot_trouble", nlohmann::json::array())) {
      if (!line.is_string()) continue;
      const std::string what = line;
      all.push_back({.level = Level::kError,
                     .name = "youbotd: " + what.substr(0, what.find(": ")),
                     .message = what,
                     .hardware_id = status.value("robot", "")});
    }
    ros::write_diagnostics(cdr, Time::from_ns(time_ns), all);
  });
}

}  // namespace operation
