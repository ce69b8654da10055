/// @file
/// The ROS 2 messages of a recording: definitions and payloads.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/mcap/cdr.h"

namespace runtime::mcap {

inline constexpr std::string_view kJointStateType = "sensor_msgs/msg/JointState";
/// sensor_msgs/JointState with the definitions that it uses, as rosbag2 stores them.
extern const std::string_view kJointStateDefinition;

/// builtin_interfaces/Time
struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;

  /// Seconds beyond 2038 do not fit and become the last second.
  static Time from_ns(std::uint64_t time_ns);
  std::int64_t ns() const { return std::int64_t{sec} * 1'000'000'000 + nanosec; }
};

/// Velocity and effort have one value per joint or none.
struct JointState {
  Time stamp;
  std::string frame_id;
  std::vector<std::string> name;
  std::vector<double> position_rad;
  std::vector<double> velocity_rad_per_s;
  std::vector<double> effort_Nm;
};
void write(CdrWriter& cdr, const JointState& state);
/// Of a message, and of all messages of a topic together.
inline constexpr std::size_t kMaxJointNames = 300;
/// @throws BadRecord if the payload is no JointState, or has more names.
JointState read_joint_state(std::string_view payload);

inline constexpr std::string_view kRecordType = "youbot_msgs/msg/Record";
/// One float64 per column. ROS allows no capitals in the name of a field: torque_command_Nm becomes
/// torque_command_nm.
std::string record_definition(const std::vector<std::string>& columns);
void write_record(CdrWriter& cdr, std::span<const double> row);

inline constexpr std::string_view kRowsType = "youbot_msgs/msg/Rows";
/// Many rows, column by column, because that compresses to half. A column with decimals is an int64[]: its
/// first value and the differences between the others, in half units of its last decimal (decimals.h). What
/// does not fit is in `unscaled`, and the int64[] is empty.
std::string rows_definition(const std::vector<std::string>& columns);
/// `rows`: one after the other, each with a number for each element of `decimals`.
void write_rows(CdrWriter& cdr, std::span<const double> rows, std::span<const std::optional<int>> decimals);
/// @throws BadRecord if the payload does not have these columns.
std::vector<double> read_rows(std::string_view payload, std::span<const std::optional<int>> decimals);

}  // namespace runtime::mcap
