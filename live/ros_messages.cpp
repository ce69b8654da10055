#include "live/ros_messages.h"

namespace live::ros {
namespace {

constexpr std::string_view kHeader = "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";
constexpr std::string_view kTime = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
constexpr std::string_view kVector = "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
constexpr std::string_view kPoint = "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n";
constexpr std::string_view kQuaternion =
    "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
constexpr std::string_view kPose = "MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n";
constexpr std::string_view kTwistDefinition = "MSG: geometry_msgs/Twist\nVector3 linear\nVector3 angular\n";

void write(CdrWriter& cdr, Time stamp) {
  cdr.number(stamp.sec);
  cdr.number(stamp.nanosec);
}

void write(CdrWriter& cdr, const Header& header) {
  write(cdr, header.stamp);
  cdr.string(header.frame_id);
}

void write(CdrWriter& cdr, const Eigen::Vector3d& vector) {
  for (const double value : vector) cdr.number(value);
}

/// Position or translation, then rotation.
void write(CdrWriter& cdr, const Eigen::Isometry3d& pose) {
  write(cdr, Eigen::Vector3d(pose.translation()));
  const Eigen::Quaterniond rotation(pose.linear());
  for (const double value : {rotation.x(), rotation.y(), rotation.z(), rotation.w()}) cdr.number(value);
}

/// Of x, y, z, roll, pitch, yaw, in rows.
void write_planar_covariance(CdrWriter& cdr, const Eigen::Matrix3d& planar) {
  constexpr std::array<Eigen::Index, 6> kPlanar{0, 1, -1, -1, -1, 2};
  for (std::size_t row = 0; row < kPlanar.size(); ++row)
    for (std::size_t column = 0; column < kPlanar.size(); ++column)
      if (kPlanar[row] >= 0 && kPlanar[column] >= 0)
        cdr.number(planar(kPlanar[row], kPlanar[column]));
      else
        cdr.number(row == column ? kNotMeasured : 0.0);
}

Twist read_twist(runtime::mcap::CdrReader& cdr) {
  Twist twist;
  for (double& value : twist.linear_m_per_s) value = cdr.float64("linear");
  for (double& value : twist.angular_rad_per_s) value = cdr.float64("angular");
  return twist;
}

}  // namespace

const Type kPoseStamped{
    "geometry_msgs/msg/PoseStamped",
    "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    {"std_msgs/Header header\ngeometry_msgs/Pose pose\n", kPose, kPoint, kQuaternion, kHeader, kTime}};
const Type kWrenchStamped{
    "geometry_msgs/msg/WrenchStamped",
    "RIHS01_8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77",
    {"std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
     "MSG: geometry_msgs/Wrench\nVector3 force\nVector3 torque\n", kVector, kHeader, kTime}};
const Type kOdometry{"nav_msgs/msg/Odometry",
                     "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
                     {"std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
                      "geometry_msgs/TwistWithCovariance twist\n",
                      "MSG: geometry_msgs/PoseWithCovariance\nPose pose\nfloat64[36] covariance\n",
                      "MSG: geometry_msgs/TwistWithCovariance\nTwist twist\nfloat64[36] covariance\n",
                      kTwistDefinition, kVector, kPose, kPoint, kQuaternion, kHeader, kTime}};
const Type kTransforms{"tf2_msgs/msg/TFMessage",
                       "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
                       {"geometry_msgs/TransformStamped[] transforms\n",
                        "MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n"
                        "Transform transform\n",
                        "MSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n", kVector,
                        kQuaternion, kHeader, kTime}};
const Type kDiagnosticArray{
    "diagnostic_msgs/msg/DiagnosticArray",
    "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    {"std_msgs/Header header\nDiagnosticStatus[] status\n",
     "MSG: diagnostic_msgs/DiagnosticStatus\nbyte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\n"
     "string name\nstring message\nstring hardware_id\nKeyValue[] values\n",
     "MSG: diagnostic_msgs/KeyValue\nstring key\nstring value\n", kHeader, kTime}};
const Type kTwist{"geometry_msgs/msg/Twist",
                  "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
                  {"Vector3 linear\nVector3 angular\n", kVector}};
const Type kTwistStamped{
    "geometry_msgs/msg/TwistStamped",
    "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    {"std_msgs/Header header\ngeometry_msgs/Twist twist\n", kTwistDefinition, kVector, kHeader, kTime}};
const Type kString{"std_msgs/msg/String",
                   "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
                   {"string data\n"}};

std::string Type::definition() const {
  const std::string separator = std::string(80, '=') + '\n';
  std::string text;
  for (const std::string_view part : parts) {
    if (part.empty()) break;
    if (!text.empty()) text += separator;
    text += part;
  }
  return text;
}

void write_pose_stamped(CdrWriter& cdr, const Header& header, const Eigen::Isometry3d& pose) {
  write(cdr, header);
  write(cdr, pose);
}

void write_wrench_stamped(CdrWriter& cdr, const Header& header, const Eigen::Vector3d& force_N,
                          const Eigen::Vector3d& moment_Nm) {
  write(cdr, header);
  write(cdr, force_N);
  write(cdr, moment_Nm);
}

void write(CdrWriter& cdr, const Odometry& odometry) {
  write(cdr, odometry.header);
  cdr.string(odometry.child_frame_id);
  write(cdr, odometry.pose);
  write_planar_covariance(cdr, odometry.pose_covariance);
  write(cdr, odometry.velocity_m_per_s);
  write(cdr, odometry.rate_rad_per_s);
  write_planar_covariance(cdr, odometry.twist_covariance);
}

void write_transforms(CdrWriter& cdr, Time stamp, const std::vector<Transform>& transforms) {
  cdr.count(transforms.size());
  for (const Transform& transform : transforms) {
    write(cdr, Header{stamp, transform.parent});
    cdr.string(transform.child);
    write(cdr, transform.X_parent_child);
  }
}

void write_diagnostics(CdrWriter& cdr, Time stamp, const std::vector<Diagnostic>& diagnostics) {
  write(cdr, Header{stamp, ""});
  cdr.count(diagnostics.size());
  for (const Diagnostic& diagnostic : diagnostics) {
    cdr.number(static_cast<std::uint8_t>(diagnostic.level));
    cdr.string(diagnostic.name);
    cdr.string(diagnostic.message);
    cdr.string(diagnostic.hardware_id);
    cdr.count(diagnostic.values.size());
    for (const auto& [key, value] : diagnostic.values) {
      cdr.string(key);
      cdr.string(value);
    }
  }
}

void write_string(CdrWriter& cdr, std::string_view text) { cdr.string(text); }

Twist read_twist(std::string_view payload) {
  runtime::mcap::CdrReader cdr(payload);
  return read_twist(cdr);
}

Twist read_twist_stamped(std::string_view payload) {
  runtime::mcap::CdrReader cdr(payload);
  cdr.int32("stamp.sec");
  cdr.uint32("stamp.nanosec");
  cdr.string("frame_id");
  return read_twist(cdr);
}

}  // namespace live::ros
