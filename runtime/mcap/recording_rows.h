/// @file
/// The rows of a recording, read one after the other from an MCAP file or from CSV text.
#pragma once
#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "runtime/mcap/mcap_reader.h"
#include "runtime/mcap/recording_head.h"

namespace runtime::mcap {

/// Gets the head, then each row; the span is valid during the call.
struct RowVisitor {
  std::function<void(const RecordingHead&)> head;
  std::function<void(std::span<const double>)> row;
  std::function<void(const std::string&)> warning = {};  ///< with file and line; may be empty
};

/// Which joints become columns.
struct JointChoice {
  /// Empty: all columns of a recording of ours; the only joint in a file of others.
  std::string joint = {};
  bool all = false;        ///< several joints of others have columns such as wheel_1_position_rad
  bool one_drive = false;  ///< a recording of ours with several joints needs a choice, too
};

/// The recording in an MCAP file: if this software wrote it, every column, or those of one joint; otherwise
/// time, position, velocity and effort from its sensor_msgs/JointState, on `/joint_states` if there are
/// several such topics. Of a file that is not complete, because it is still written or its program was
/// killed, what is there, and a warning. `open` begins at the beginning of the file; it is called twice.
/// @throws McapError; ConfigError listing the joints or topics if the choice is not clear.
void read_mcap_rows(const std::function<ReadBytes()>& open, const std::string& file,
                    const JointChoice& choice, const RowVisitor& visitor);

/// The rows of CSV text, with any numbers, not only valid measurements. A column has decimals if all of its
/// values are written with the same number of them. A torn last line is left out, and rows that a program
/// still appends, each with a warning. A repeated or decreasing time and an infinite value are kept, with a
/// warning at the first row of each.
/// @throws ConfigError with file and line; also for what visitor.row() throws as std::invalid_argument.
void read_csv_rows(const std::filesystem::path& path, const RowVisitor& visitor);

}  // namespace runtime::mcap
