#include "runtime/mcap/ros_messages.h"

#include <algorithm>
#include <limits>
#include <set>

namespace runtime::mcap {

const std::string_view kJointStateDefinition =
    R"(# Position of a joint is in rad, its velocity in rad/s, its effort in Nm.
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
)";

Time Time::from_ns(std::uint64_t time_ns) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  constexpr std::uint64_t kLast = std::numeric_limits<std::int32_t>::max();
  return {static_cast<std::int32_t>(std::min(time_ns / kSecond, kLast)),
          static_cast<std::uint32_t>(time_ns % kSecond)};
}

void write(CdrWriter& cdr, const JointState& state) {
  cdr.number(state.stamp.sec);
  cdr.number(state.stamp.nanosec);
  cdr.string(state.frame_id);
  cdr.count(state.name.size());
  for (const std::string& joint : state.name) cdr.string(joint);
  for (const auto* values : {&state.position_rad, &state.velocity_rad_per_s, &state.effort_Nm}) {
    cdr.count(values->size());
    for (const double value : *values) cdr.number(value);
  }
}

JointState read_joint_state(std::string_view payload) {
  CdrReader cdr(payload);
  JointState state;
  state.stamp.sec = cdr.int32("header.stamp.sec");
  state.stamp.nanosec = cdr.uint32("header.stamp.nanosec");
  state.frame_id = cdr.string("header.frame_id");
  const std::size_t names = cdr.count("name", 4);
  if (names > kMaxJointNames)
    throw BadRecord("more than " + std::to_string(kMaxJointNames) + " joint names in a message");
  state.name.resize(names);
  for (std::string& joint : state.name) joint = cdr.string("name");
  const auto values = [&](const char* field, std::vector<double>& out) {
    out.resize(cdr.count(field, sizeof(double)));
    for (double& value : out) value = cdr.float64(field);
    if (!out.empty() && out.size() != state.name.size())
      throw BadRecord(std::string(field) + " has " + std::to_string(out.size()) + " values for " +
                      std::to_string(state.name.size()) + " joints");
  };
  values("position", state.position_rad);
  values("velocity", state.velocity_rad_per_s);
  values("effort", state.effort_Nm);
  return state;
}

namespace {

/// ROS allows lower-case letters, digits and single underscores between them, and a letter first.
std::string field_name(std::string_view column) {
  std::string field;
  for (const char c : column) {
    const auto lower = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
    const bool letter = lower >= 'a' && lower <= 'z';
    const bool digit = lower >= '0' && lower <= '9';
    if (letter || (digit && !field.empty()))
      field += lower;
    else if (digit)
      field = std::string("c") + lower;
    else if (!field.empty() && field.back() != '_')
      field += '_';
  }
  while (field.ends_with('_')) field.pop_back();
  return field.empty() ? "c" : field;
}

}  // namespace

std::string record_definition(const std::vector<std::string>& columns) {
  std::set<std::string> given;
  std::string text;
  for (const std::string& column : columns) {
    const std::string name = field_name(column);
    std::string field = name;
    for (int i = 2; !given.insert(field).second; ++i) field = name + "_" + std::to_string(i);
    text += "float64 " + field + '\n';
  }
  return text;
}

void write_record(CdrWriter& cdr, std::span<const double> row) {
  for (const double value : row) cdr.number(value);
}

void read_record(std::string_view payload, std::span<double> row) {
  constexpr std::size_t kHead = 4;
  if (payload.size() != kHead + row.size_bytes())
    throw BadRecord("a row of " + std::to_string(payload.size()) + " bytes for " +
                    std::to_string(row.size()) + " columns");
  CdrReader cdr(payload);
  for (double& value : row) value = cdr.float64("a column");
}

}  // namespace runtime::mcap
