/// @file
/// The ROS 2 messages of stream and topics, beside sensor_msgs/JointState of runtime/mcap/ros_messages.h.
#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/mcap/cdr.h"
#include "runtime/mcap/ros_messages.h"

namespace live::ros {

using runtime::mcap::CdrWriter;
using runtime::mcap::Time;

struct Type {
  std::string_view name;
  std::string_view hash;                   ///< RIHS01 of REP 2011: of all names and types of its fields
  std::array<std::string_view, 10> parts;  ///< its fields, then each definition that it uses

  /// As rosbag2 stores it.
  std::string definition() const;
};
/// Of runtime::mcap::kJointStateType.
inline constexpr std::string_view kJointStateHash =
    "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e";
extern const Type kPoseStamped;
extern const Type kWrenchStamped;
extern const Type kOdometry;
extern const Type kTransforms;
extern const Type kDiagnosticArray;
extern const Type kTwist;
extern const Type kTwistStamped;
extern const Type kString;

struct Header {
  Time stamp;
  std::string frame_id;
};

void write_pose_stamped(CdrWriter& cdr, const Header& header, const Eigen::Isometry3d& pose);
void write_wrench_stamped(CdrWriter& cdr, const Header& header, const Eigen::Vector3d& force_N,
                          const Eigen::Vector3d& moment_Nm);

/// Variance of what is not known, as is usual in ROS.
inline constexpr double kNotMeasured = 1e6;

/// Motion on a level floor. Covariances of x, y, yaw: of `pose` in the frame of the header, of the twist in
/// that of the child.
struct Odometry {
  Header header;
  std::string child_frame_id;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  Eigen::Matrix3d pose_covariance = kNotMeasured * Eigen::Matrix3d::Identity();
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_rad_per_s = Eigen::Vector3d::Zero();
  Eigen::Matrix3d twist_covariance = kNotMeasured * Eigen::Matrix3d::Identity();
};
void write(CdrWriter& cdr, const Odometry& odometry);

struct Transform {
  std::string parent;
  std::string child;
  Eigen::Isometry3d X_parent_child = Eigen::Isometry3d::Identity();
};
void write_transforms(CdrWriter& cdr, Time stamp, const std::vector<Transform>& transforms);

struct Diagnostic {
  enum class Level : std::uint8_t { kOk, kWarn, kError, kStale };
  Level level = Level::kOk;
  std::string name;
  std::string message;
  std::string hardware_id;
  std::vector<std::pair<std::string, std::string>> values{};
};
void write_diagnostics(CdrWriter& cdr, Time stamp, const std::vector<Diagnostic>& diagnostics);

void write_string(CdrWriter& cdr, std::string_view text);

struct Twist {
  Eigen::Vector3d linear_m_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rad_per_s = Eigen::Vector3d::Zero();
};
/// Any numbers, also not finite ones. @throws runtime::mcap::BadRecord if the payload is no such message.
Twist read_twist(std::string_view payload);
Twist read_twist_stamped(std::string_view payload);

}  // namespace live::ros
