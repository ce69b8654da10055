/// @file
/// Writes the rows of a recording as ROS 2 messages.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runtime/mcap/cdr.h"
#include "runtime/mcap/mcap_writer.h"
#include "runtime/mcap/recording_head.h"
#include "runtime/mcap/ros_messages.h"

namespace runtime::mcap {

/// Chunks end with the blocks of rows.
WriterOptions recording_options();

/// Three topics: `/rows` has every row, in blocks of youbot_msgs/Rows. `/record` has a youbot_msgs/Record
/// with every column, and `/joint_states` a sensor_msgs/JointState with the joints among them, if there are
/// any. These two are for display and larger than the rows that they repeat, so they come at 100 Hz.
///
///     RecordingWriter recording(writer, head);
///     for (...) {
///       if (recording.full()) recording.end_block();
///       recording.append_row(row);
///     }
///     recording.end_block();
class RecordingWriter {
 public:
  /// Writes metadata, schemas and channels. @throws std::invalid_argument without a column `time_s`.
  RecordingWriter(McapWriter& writer, const RecordingHead& head,
                  std::chrono::nanoseconds display_period = std::chrono::milliseconds(10));

  /// Into the block. @throws std::invalid_argument for a row of another width, or a time before 1970.
  void append_row(std::span<const double> row);
  bool full() const noexcept { return rows_in_block() >= kMaxBlockRows; }
  std::size_t rows_in_block() const noexcept { return times_ns_.size(); }
  void discard_block() noexcept;
  /// Writes the block, if it has rows, as a chunk. Whatever the writer throws passes through; the rows are
  /// gone then.
  void end_block();

 private:
  /// A second at 1 kHz. More rows hardly take less space.
  static constexpr std::size_t kMaxBlockRows = 1000;

  void add_for_display(std::size_t row);

  McapWriter& writer_;
  RecordingHead head_;
  std::size_t time_column_ = 0;
  std::uint64_t start_ns_ = 0;
  std::uint16_t rows_channel_ = 0;
  std::uint16_t record_channel_ = 0;
  std::uint16_t joint_channel_ = 0;
  std::vector<JointColumns> joints_;
  JointState joint_state_;
  std::uint64_t display_period_ns_;
  std::optional<std::uint64_t> next_display_ns_;
  std::uint64_t last_ns_ = 0;
  std::vector<std::optional<int>> decimals_;  // by column
  std::vector<double> block_;                 // rows, one after the other
  std::vector<std::uint64_t> times_ns_;       // of these rows
  std::vector<double> row_;                   // for display
  CdrWriter cdr_;
};

}  // namespace runtime::mcap
