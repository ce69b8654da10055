// Payloads against the layout of the ROS 2 definitions in CDR: after a head of four bytes, each number stands
// at a multiple of its size, and a string is its length with the final zero, then its characters.
#include "live/ros_messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

namespace ros_messages_test {

namespace ros = live::ros;
using Eigen::Vector3d;
using runtime::mcap::CdrWriter;

/// Bytes by their place after the head.
struct Payload {
  explicit Payload(const CdrWriter& cdr) : bytes(cdr.payload().substr(4)), head(cdr.payload().substr(0, 4)) {}
  std::uint32_t u32(std::size_t at) const {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.substr(at, 4).data(), 4);
    return value;
  }
  double f64(std::size_t at) const {
    double value = 0;
    std::memcpy(&value, bytes.substr(at, 8).data(), 8);
    return value;
  }
  Vector3d vector(std::size_t at) const { return {f64(at), f64(at + 8), f64(at + 16)}; }
  std::string text(std::size_t at, std::size_t size) const { return bytes.substr(at, size); }
  std::string bytes;
  std::string head;
};

/// 90° around z: q = (0, 0, √½, √½).
Eigen::Isometry3d quarter_turn_at(const Vector3d& place) {
  return Eigen::Translation3d(place) *
         Eigen::Isometry3d(Eigen::AngleAxisd(std::acos(0.0), Vector3d::UnitZ()));
}
const double kRootOfHalf = std::sqrt(0.5);

void expect_quarter_turn(const Payload& payload, std::size_t at) {
  EXPECT_NEAR(payload.f64(at), 0, 1e-15) << "x";
  EXPECT_NEAR(payload.f64(at + 8), 0, 1e-15) << "y";
  EXPECT_NEAR(payload.f64(at + 16), kRootOfHalf, 1e-15) << "z";
  EXPECT_NEAR(payload.f64(at + 24), kRootOfHalf, 1e-15) << "w comes last in ROS";
}

TEST(RosMessages, AStringIsItsLengthAndItsCharacters) {
  CdrWriter cdr;
  ros::write_string(cdr, "urdf");
  EXPECT_EQ(cdr.payload(), std::string_view("\0\1\0\0"
                                            "\5\0\0\0"
                                            "urdf\0",
                                            13));
}

TEST(RosMessages, APoseFollowsItsHeaderAtAMultipleOfEight) {
  CdrWriter cdr;
  ros::write_pose_stamped(cdr, {{1, 2}, "map"}, quarter_turn_at({1, 2, 3}));
  const Payload pose(cdr);
  EXPECT_EQ(pose.head, std::string("\0\1\0\0", 4)) << "CDR, little-endian";
  EXPECT_EQ(pose.u32(0), 1U) << "sec";
  EXPECT_EQ(pose.u32(4), 2U) << "nanosec";
  EXPECT_EQ(pose.u32(8), 4U);
  EXPECT_EQ(pose.text(12, 4), std::string("map\0", 4));
  EXPECT_EQ(pose.vector(16), Vector3d(1, 2, 3));
  expect_quarter_turn(pose, 40);
  EXPECT_EQ(pose.bytes.size(), 72U);

  cdr.clear();
  ros::write_pose_stamped(cdr, {{1, 2}, "world"}, quarter_turn_at({1, 2, 3}));
  const Payload padded(cdr);
  EXPECT_EQ(padded.text(12, 12), std::string("world\0\0\0\0\0\0\0", 12))
      << "the name ends at 18, the pose begins at 24";
  EXPECT_EQ(padded.vector(24), Vector3d(1, 2, 3));
  EXPECT_EQ(padded.bytes.size(), 80U);
}

TEST(RosMessages, AWrenchIsForceThenTorque) {
  CdrWriter cdr;
  ros::write_wrench_stamped(cdr, {{-1, 999'999'999}, ""}, {1, -2, 3}, {4, 5, -6});
  const Payload wrench(cdr);
  EXPECT_EQ(wrench.u32(0), 0xFFFFFFFFU);
  EXPECT_EQ(wrench.u32(4), 999'999'999U);
  EXPECT_EQ(wrench.u32(8), 1U) << "an empty name is its final zero";
  EXPECT_EQ(wrench.vector(16), Vector3d(1, -2, 3));
  EXPECT_EQ(wrench.vector(40), Vector3d(4, 5, -6));
  EXPECT_EQ(wrench.bytes.size(), 64U);
}

TEST(RosMessages, OdometryHasPoseAndTwistEachWithTheCovarianceInThePlane) {
  CdrWriter cdr;
  ros::Odometry message{.header = {{1, 2}, "odom"},
                        .child_frame_id = "base",
                        .pose = quarter_turn_at({1, 2, 0}),
                        .velocity_m_per_s = {0.5, -0.25, 0},
                        .rate_rad_per_s = {0, 0, 2}};
  message.pose_covariance << 1, 2, 3, 2, 4, 5, 3, 5, 6;
  message.twist_covariance = 10 * message.pose_covariance;
  write(cdr, message);
  const Payload odometry(cdr);
  EXPECT_EQ(odometry.u32(8), 5U);
  EXPECT_EQ(odometry.text(12, 5), std::string("odom\0", 5));
  EXPECT_EQ(odometry.u32(20), 5U) << "from 17 to the next multiple of four";
  EXPECT_EQ(odometry.text(24, 5), std::string("base\0", 5));
  EXPECT_EQ(odometry.vector(32), Vector3d(1, 2, 0)) << "from 29 to the next multiple of eight";
  expect_quarter_turn(odometry, 56);
  const std::size_t twist = 88 + 36 * 8;
  // x, y, z, roll, pitch, yaw in rows; what wheels do not measure is uncertain.
  const auto expect_covariance = [&](std::size_t at, double scale) {
    const std::array<std::array<double, 6>, 6> expected{{{1, 2, 0, 0, 0, 3},
                                                         {2, 4, 0, 0, 0, 5},
                                                         {0, 0, 1e6, 0, 0, 0},
                                                         {0, 0, 0, 1e6, 0, 0},
                                                         {0, 0, 0, 0, 1e6, 0},
                                                         {3, 5, 0, 0, 0, 6}}};
    for (std::size_t row = 0; row < 6; ++row)
      for (std::size_t column = 0; column < 6; ++column) {
        const bool measured = expected[row][column] < 1e6;
        EXPECT_EQ(odometry.f64(at + 8 * (6 * row + column)), expected[row][column] * (measured ? scale : 1))
            << row << ", " << column;
      }
  };
  expect_covariance(88, 1);
  EXPECT_EQ(odometry.vector(twist), Vector3d(0.5, -0.25, 0));
  EXPECT_EQ(odometry.vector(twist + 24), Vector3d(0, 0, 2));
  expect_covariance(twist + 48, 10);
  EXPECT_EQ(odometry.bytes.size(), twist + 48 + 36 * 8);
}

TEST(RosMessages, EachTransformHasItsOwnHeader) {
  CdrWriter cdr;
  ros::write_transforms(cdr, {1, 2},
                        {{"map", "a", quarter_turn_at({1, 2, 3})}, {"a", "bc", quarter_turn_at({4, 5, 6})}});
  const Payload transforms(cdr);
  EXPECT_EQ(transforms.u32(0), 2U) << "number of transforms";
  EXPECT_EQ(transforms.u32(4), 1U);
  EXPECT_EQ(transforms.u32(8), 2U);
  EXPECT_EQ(transforms.u32(12), 4U);
  EXPECT_EQ(transforms.text(16, 4), std::string("map\0", 4));
  EXPECT_EQ(transforms.u32(20), 2U);
  EXPECT_EQ(transforms.text(24, 2), std::string("a\0", 2));
  EXPECT_EQ(transforms.vector(32), Vector3d(1, 2, 3)) << "translation comes first";
  expect_quarter_turn(transforms, 56);
  EXPECT_EQ(transforms.u32(88), 1U) << "the second one";
  EXPECT_EQ(transforms.u32(96), 2U);
  EXPECT_EQ(transforms.text(100, 2), std::string("a\0", 2));
  EXPECT_EQ(transforms.u32(104), 3U);
  EXPECT_EQ(transforms.text(108, 3), std::string("bc\0", 3));
  EXPECT_EQ(transforms.vector(112), Vector3d(4, 5, 6));
  EXPECT_EQ(transforms.bytes.size(), 168U);
}

TEST(RosMessages, ADiagnosticHasItsLevelInOneByte) {
  CdrWriter cdr;
  ros::write_diagnostics(
      cdr, {1, 2},
      {{.level = ros::Diagnostic::Level::kError,
        .name = "n",
        .message = "mm",
        .hardware_id = "hhh",
        .values = {{"key", "1"}}},
       {.level = ros::Diagnostic::Level::kStale, .name = "", .message = "", .hardware_id = ""}});
  const Payload diagnostics(cdr);
  EXPECT_EQ(diagnostics.u32(8), 1U) << "no frame";
  EXPECT_EQ(diagnostics.u32(16), 2U) << "number of states";
  EXPECT_EQ(diagnostics.bytes[20], '\2') << "ERROR";
  EXPECT_EQ(diagnostics.u32(24), 2U);
  EXPECT_EQ(diagnostics.text(28, 2), std::string("n\0", 2));
  EXPECT_EQ(diagnostics.u32(32), 3U);
  EXPECT_EQ(diagnostics.text(36, 3), std::string("mm\0", 3));
  EXPECT_EQ(diagnostics.u32(40), 4U);
  EXPECT_EQ(diagnostics.text(44, 4), std::string("hhh\0", 4));
  EXPECT_EQ(diagnostics.u32(48), 1U) << "number of values";
  EXPECT_EQ(diagnostics.u32(52), 4U);
  EXPECT_EQ(diagnostics.text(56, 4), std::string("key\0", 4));
  EXPECT_EQ(diagnostics.u32(60), 2U);
  EXPECT_EQ(diagnostics.text(64, 2), std::string("1\0", 2));
  EXPECT_EQ(diagnostics.bytes[66], '\3') << "STALE follows without a gap: a byte needs none";
}

TEST(RosMessages, ADefinitionIsFollowedByThoseItUses) {
  EXPECT_EQ(ros::kString.definition(), "string data\n");
  const std::string rule = std::string(80, '=') + "\n";
  EXPECT_EQ(ros::kWrenchStamped.definition(),
            "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n" + rule +
                "MSG: geometry_msgs/Wrench\nVector3 force\nVector3 torque\n" + rule +
                "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n" + rule +
                "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + rule +
                "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n");
}

}  // namespace ros_messages_test
