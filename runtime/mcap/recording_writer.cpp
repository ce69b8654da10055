#include "runtime/mcap/recording_writer.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "runtime/mcap/decimals.h"

namespace runtime::mcap {

RecordingWriter::RecordingWriter(McapWriter& writer, const RecordingHead& head,
                                 std::chrono::nanoseconds joint_state_period)
    : writer_(writer),
      head_(head),
      start_ns_(head.start_ns()),
      joints_(joints_of(head)),
      joint_state_period_ns_(static_cast<std::uint64_t>(joint_state_period.count())),
      row_(head.columns.size()) {
  const auto time = head_.column("time_s");
  if (!time) throw std::invalid_argument("the recording has no column time_s");
  time_column_ = *time;
  std::vector<std::string> names;
  for (const auto& column : head_.columns) names.push_back(column.name);

  writer_.add_metadata(kRecordingMetadata, metadata_of(head_));
  const std::uint16_t record = writer_.add_schema(kRecordType, "ros2msg", record_definition(names));
  record_channel_ = writer_.add_channel(record, "/record", "cdr", channel_metadata_of(head_));
  if (joints_.empty()) return;
  const std::uint16_t joint_state = writer_.add_schema(kJointStateType, "ros2msg", kJointStateDefinition);
  joint_channel_ = writer_.add_channel(joint_state, "/joint_states", "cdr", {});
  for (const JointColumns& joint : joints_) joint_state_.name.push_back(joint.joint);
  joint_state_.position_rad.resize(joints_.size());
  // ROS: an array is empty if no joint has such a value.
  if (std::ranges::any_of(joints_, [](const JointColumns& joint) { return joint.velocity.has_value(); }))
    joint_state_.velocity_rad_per_s.resize(joints_.size());
  if (std::ranges::any_of(joints_, [](const JointColumns& joint) { return joint.effort.has_value(); }))
    joint_state_.effort_Nm.resize(joints_.size());
}

void RecordingWriter::append_row(std::span<const double> row) {
  if (row.size() != row_.size()) throw std::invalid_argument("a row of another width");
  for (std::size_t i = 0; i < row.size(); ++i)
    row_[i] = head_.columns[i].decimals ? rounded_to_binary(row[i], *head_.columns[i].decimals) : row[i];

  const double since_start_ns = std::nearbyint(row[time_column_] * 1e9);
  constexpr double kLast = 9e18;  // year 2255
  if (!(since_start_ns > -static_cast<double>(start_ns_) - 1 && since_start_ns < kLast))
    throw std::invalid_argument(fmt::format(
        "time_s is {:g}; the times of an MCAP file are those from 1970 to 2255", row[time_column_]));
  const auto time_ns = start_ns_ + static_cast<std::uint64_t>(static_cast<std::int64_t>(since_start_ns));

  // The sequence stays 0, which MCAP allows: a gap shows in the times, and a counter takes 3 % of the file.
  cdr_.clear();
  write_record(cdr_, row_);
  writer_.add_message({record_channel_, 0, time_ns, time_ns, cdr_.payload()});
  if (time_ns < last_ns_) next_joint_state_ns_.reset();  // the time began again
  last_ns_ = time_ns;
  if (!joints_.empty() && time_ns >= next_joint_state_ns_.value_or(time_ns)) add_joint_state(time_ns);
}

void RecordingWriter::add_joint_state(std::uint64_t time_ns) {
  // A cycle that is a little early does not lose its turn to the next one.
  constexpr std::uint64_t kJitter_ns = 100'000;
  next_joint_state_ns_ = time_ns + joint_state_period_ns_ - std::min(joint_state_period_ns_, kJitter_ns);
  const auto value = [&](std::optional<std::size_t> column) {
    return column ? row_[*column] : std::numeric_limits<double>::quiet_NaN();
  };
  joint_state_.stamp = Time::from_ns(time_ns);
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    joint_state_.position_rad[i] = row_[joints_[i].position];
    if (!joint_state_.velocity_rad_per_s.empty())
      joint_state_.velocity_rad_per_s[i] = value(joints_[i].velocity);
    if (!joint_state_.effort_Nm.empty()) joint_state_.effort_Nm[i] = value(joints_[i].effort);
  }
  cdr_.clear();
  write(cdr_, joint_state_);
  writer_.add_message({joint_channel_, 0, time_ns, time_ns, cdr_.payload()});
}

}  // namespace runtime::mcap
