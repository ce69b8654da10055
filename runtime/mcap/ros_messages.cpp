#include "runtime/mcap/ros_messages.h"

#include <algorithm>
#include <limits>
#include <set>

#include "runtime/mcap/decimals.h"

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

/// "TYPE name" for each column, with names that differ.
std::string fields(const std::vector<std::string>& columns, const char* type, std::set<std::string> given) {
  std::string text;
  for (const std::string& column : columns) {
    const std::string name = field_name(column);
    std::string field = name;
    for (int i = 2; !given.insert(field).second; ++i) field = name + "_" + std::to_string(i);
    text += std::string(type) + ' ' + field + '\n';
  }
  return text;
}

}  // namespace

std::string record_definition(const std::vector<std::string>& columns) {
  return fields(columns, "float64", {});
}

void write_record(CdrWriter& cdr, std::span<const double> row) {
  for (const double value : row) cdr.number(value);
}

std::string rows_definition(const std::vector<std::string>& columns) {
  return "# Rows, column by column: the first value, then differences, in half units of the last decimal.\n"
         "# A column that is empty is in `unscaled`, as numbers, one such column after the other.\n"
         "# Topic /record has rows as numbers at 100 Hz; `youbotctl convert` writes all of them.\n"
         "uint32 rows\n" +
         fields(columns, "int64[]", {"rows", "unscaled"}) + "float64[] unscaled\n";
}

void write_rows(CdrWriter& cdr, std::span<const double> rows, std::span<const std::optional<int>> decimals) {
  const std::size_t width = decimals.size();
  const std::size_t count = rows.size() / width;
  std::vector<double> unscaled;
  std::vector<std::int64_t> scaled;
  cdr.count(count);
  for (std::size_t column = 0; column < width; ++column) {
    scaled.clear();
    for (std::size_t row = 0; row < count && decimals[column]; ++row) {
      const auto value = in_half_units(rows[row * width + column], *decimals[column]);
      if (!value) break;
      scaled.push_back(*value);
    }
    if (scaled.size() < count) {
      scaled.clear();
      for (std::size_t row = 0; row < count; ++row) unscaled.push_back(rows[row * width + column]);
    }
    cdr.count(scaled.size());
    std::int64_t last = 0;
    for (const std::int64_t value : scaled) {
      cdr.number(value - last);
      last = value;
    }
  }
  cdr.count(unscaled.size());
  for (const double value : unscaled) cdr.number(value);
}

std::vector<double> read_rows(std::string_view payload, std::span<const std::optional<int>> decimals) {
  CdrReader cdr(payload);
  const std::size_t width = decimals.size();
  const std::size_t count = cdr.uint32("rows");
  const auto refuse = [](const std::string& problem) { throw BadRecord("rows: " + problem); };
  if (count > payload.size() / width) refuse("more than the payload can hold");
  std::vector<double> rows(count * width);
  std::vector<std::size_t> unscaled;
  for (std::size_t column = 0; column < width; ++column) {
    const std::size_t values = cdr.count("a column", sizeof(std::int64_t));
    if (values == 0) {
      unscaled.push_back(column);
      continue;
    }
    if (values != count || !decimals[column]) refuse("a column of another length, or without decimals");
    std::int64_t last = 0;
    for (std::size_t row = 0; row < count; ++row) {
      // Unsigned: a damaged file must not overflow.
      last = static_cast<std::int64_t>(static_cast<std::uint64_t>(last) +
                                       static_cast<std::uint64_t>(cdr.int64("a column")));
      rows[row * width + column] = from_half_units(last, *decimals[column]);
    }
  }
  if (cdr.count("unscaled", sizeof(double)) != unscaled.size() * count)
    refuse("`unscaled` of another length than the columns in it");
  for (const std::size_t column : unscaled)
    for (std::size_t row = 0; row < count; ++row) rows[row * width + column] = cdr.float64("unscaled");
  return rows;
}

}  // namespace runtime::mcap
