/// @file
/// Writes the rows of a recording as ROS 2 messages.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/mcap/cdr.h"
#include "runtime/mcap/mcap_writer.h"
#include "runtime/mcap/recording_head.h"
#include "runtime/mcap/ros_messages.h"

namespace runtime::mcap {

/// Two topics: `/record` has a youbot_msgs/Record with every column, `/joint_states` a sensor_msgs/JointState
/// with the joints among them, if there are any. Joint states are for display and much larger than the
/// columns that they repeat, so they come at 100 Hz.
class RecordingWriter {
 public:
  /// Writes metadata, schemas and channels. @throws std::invalid_argument without a column `time_s`.
  RecordingWriter(McapWriter& writer, const RecordingHead& head,
                  std::chrono::nanoseconds joint_state_period = std::chrono::milliseconds(10));

  /// @throws std::invalid_argument for a row of another width, or a time before 1970.
  void append_row(std::span<const double> row);

 private:
  void add_joint_state(std::uint64_t time_ns);

  McapWriter& writer_;
  RecordingHead head_;
  std::size_t time_column_ = 0;
  std::uint64_t start_ns_ = 0;
  std::uint16_t record_channel_ = 0;
  std::uint16_t joint_channel_ = 0;
  std::vector<JointColumns> joints_;
  JointState joint_state_;
  std::uint64_t joint_state_period_ns_;
  std::optional<std::uint64_t> next_joint_state_ns_;
  std::uint64_t last_ns_ = 0;
  std::vector<double> row_;
  CdrWriter cdr_;
};

}  // namespace runtime::mcap
