/// @file
/// What precedes the rows of a recording, and how it is stored in an MCAP file.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/mcap/bytes.h"
#include "runtime/mcap/mcap_writer.h"
#include "runtime/recording/recording_file.h"

namespace runtime::mcap {

/// Comments and columns as in the CSV text. A column without decimals has the shortest text of each value.
struct RecordingHead {
  std::vector<RecordingFile::Comment> comments;
  std::vector<RecordingFile::Column> columns;

  /// Empty if there is no such comment.
  std::string_view comment(std::string_view key) const noexcept;
  std::optional<std::size_t> column(std::string_view column_name) const noexcept;
  /// From the comment `started`, UTC, up to nanoseconds: "2026-11-26T22:03:08.250Z". Zero without one, or for
  /// any other text.
  std::uint64_t start_ns() const;
};

/// Name of the metadata record: each comment under its key, and all of them in order under `comments`.
inline constexpr std::string_view kRecordingMetadata = "recording";
StringMap metadata_of(const RecordingHead& head);
/// Metadata of the channel with the rows: the names and decimals of the columns.
StringMap channel_metadata_of(const RecordingHead& head);
/// Undoes both. @throws BadRecord if the columns are missing or malformed.
RecordingHead head_from(const StringMap& recording, const StringMap& channel);

/// A configuration, or a model, that belongs to the recording.
Attachment toml_attachment(const std::string& name, const std::string& text, std::uint64_t time_ns);

/// A joint and where its values are in a row.
struct JointColumns {
  std::string joint;
  std::size_t position = 0;
  std::optional<std::size_t> velocity;
  std::optional<std::size_t> effort;
};
/// The joints whose position the recording has: `wheel_1` for the column wheel_1_position_rad, the name of
/// the rig for position_rad.
std::vector<JointColumns> joints_of(const RecordingHead& head);

}  // namespace runtime::mcap
