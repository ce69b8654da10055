#include "runtime/mcap/recording_writer.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "runtime/mcap/decimals.h"
#include "runtime/program/build_info.h"

namespace runtime::mcap {

WriterOptions recording_options() {
  return {.library = std::string("youbot-hal ") + build_version(),
          .chunk_period = std::chrono::nanoseconds::max(),
          .chunk_bytes = std::numeric_limits<std::size_t>::max()};
}

RecordingWriter::RecordingWriter(McapWriter& writer, const RecordingHead& head,
                                 std::chrono::nanoseconds display_period)
    : writer_(writer),
      head_(head),
      start_ns_(head.start_ns()),
      joints_(joints_of(head)),
      display_period_ns_(static_cast<std::uint64_t>(display_period.count())),
      row_(head.columns.size()) {
  const auto time = head_.column("time_s");
  if (!time) throw std::invalid_argument("the recording has no column time_s");
  time_column_ = *time;
  block_.reserve(kMaxBlockRows * row_.size());  // append_row() does all or nothing
  times_ns_.reserve(kMaxBlockRows);
  std::vector<std::string> names;
  for (const auto& column : head_.columns) {
    names.push_back(column.name);
    decimals_.push_back(column.decimals);
  }

  writer_.add_metadata(kRecordingMetadata, metadata_of(head_));
  const std::uint16_t rows = writer_.add_schema(kRowsType, "ros2msg", rows_definition(names));
  rows_channel_ = writer_.add_channel(rows, "/rows", "cdr", channel_metadata_of(head_));
  const std::uint16_t record = writer_.add_schema(kRecordType, "ros2msg", record_definition(names));
  record_channel_ = writer_.add_channel(record, "/record", "cdr", {});
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
  if (row.size() != decimals_.size()) throw std::invalid_argument("a row of another width");
  const double since_start_ns = std::nearbyint(row[time_column_] * 1e9);
  constexpr double kLast = 9e18;  // year 2255
  // Negated so that NaN fails the check.
  if (!(std::abs(since_start_ns) < kLast) ||
      static_cast<std::int64_t>(since_start_ns) < -static_cast<std::int64_t>(start_ns_))
    throw std::invalid_argument(fmt::format(
        "time_s is {:g}; the times of an MCAP file are those from 1970 to 2255", row[time_column_]));
  block_.insert(block_.end(), row.begin(), row.end());
  times_ns_.push_back(start_ns_ + static_cast<std::uint64_t>(static_cast<std::int64_t>(since_start_ns)));
}

void RecordingWriter::discard_block() noexcept {
  block_.clear();
  times_ns_.clear();
}

void RecordingWriter::end_block() {
  if (times_ns_.empty()) return;
  // The sequence of all messages stays 0, which MCAP allows: a gap shows in the times.
  cdr_.clear();
  write_rows(cdr_, block_, decimals_);
  writer_.add_message({rows_channel_, 0, times_ns_.front(), times_ns_.front(), cdr_.payload()});
  for (std::size_t row = 0; row < times_ns_.size(); ++row) {
    const std::uint64_t time_ns = times_ns_[row];
    if (time_ns < last_ns_) next_display_ns_.reset();  // the time began again
    last_ns_ = time_ns;
    if (time_ns >= next_display_ns_.value_or(time_ns)) add_for_display(row);
  }
  discard_block();
  writer_.end_chunk();
}

void RecordingWriter::add_for_display(std::size_t row) {
  // A cycle that is a little early does not lose its turn to the next one.
  constexpr std::uint64_t kJitter_ns = 100'000;
  const std::uint64_t time_ns = times_ns_[row];
  next_display_ns_ = time_ns + display_period_ns_ - std::min(display_period_ns_, kJitter_ns);
  const std::span<const double> values = std::span(block_).subspan(row * row_.size(), row_.size());
  for (std::size_t i = 0; i < row_.size(); ++i)
    row_[i] = decimals_[i] ? rounded_to_binary(values[i], *decimals_[i]) : values[i];
  cdr_.clear();
  write_record(cdr_, row_);
  writer_.add_message({record_channel_, 0, time_ns, time_ns, cdr_.payload()});
  if (joints_.empty()) return;

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
