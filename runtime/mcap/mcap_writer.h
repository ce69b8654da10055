/// @file
/// Writes an MCAP file, version 1, with chunks, indexes, summary and checksums (https://mcap.dev/spec).
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/mcap/bytes.h"
#include "runtime/mcap/compression.h"
#include "runtime/mcap/format.h"

namespace runtime::mcap {

struct WriterOptions {
  std::string profile = "ros2";
  std::string library = {};
  Compression compression = Compression::kZstd;
  /// A chunk ends when its messages span this time, or this size. A killed program loses its last chunk.
  std::chrono::nanoseconds chunk_period = std::chrono::milliseconds(100);
  std::size_t chunk_bytes = std::size_t{1} << 20;
};

/// Times are nanoseconds since 1970, or since the start where that is unknown.
struct Message {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::string_view data = {};
};

struct Attachment {
  std::string name = {};
  std::string media_type = {};
  std::uint64_t log_time_ns = 0;
  std::uint64_t create_time_ns = 0;
  std::string data = {};
};

/// `write` gets the file piece by piece; a chunk with its index is one piece, and so is all that follows the
/// last chunk. Whatever `write` throws passes
/// through; the piece then counts as not written, and others may follow.
///
///     McapWriter writer([&](std::string_view bytes) { file.write(bytes); }, {.library = "..."});
///     const auto schema = writer.add_schema("sensor_msgs/msg/JointState", "ros2msg", text);
///     const auto channel = writer.add_channel(schema, "/joint_states", "cdr", {});
///     writer.add_message({channel, 0, time, time, payload});
///     writer.finish();
class McapWriter {
 public:
  McapWriter(std::function<void(std::string_view)> write, WriterOptions options);

  /// @throws std::length_error for more than 65535, as for channels.
  std::uint16_t add_schema(std::string_view name, std::string_view encoding, std::string_view data);
  /// `schema` 0: none.
  std::uint16_t add_channel(std::uint16_t schema, std::string_view topic, std::string_view message_encoding,
                            const StringMap& metadata);
  void add_message(const Message& message);
  void add_metadata(std::string_view metadata_name, const StringMap& metadata);
  void add_attachment(const Attachment& attachment);
  /// Passes everything so far to `write`: a reader finds it even if nothing follows.
  void end_chunk();
  /// Ends the file with its summary. Nothing may follow.
  void finish();

 private:
  struct IndexEntry {
    std::uint64_t log_time_ns;
    std::uint64_t offset;
  };

  void write_record(Opcode opcode, std::string_view content);
  void write(std::string_view bytes);
  void count_chunk(const std::map<std::uint16_t, std::vector<IndexEntry>>& index);
  std::string statistics() const;

  std::function<void(std::string_view)> write_;
  WriterOptions options_;
  std::optional<std::string> ending_;  // what finish() gathers
  std::uint64_t position_ = 0;
  std::uint32_t crc_ = 0;  // of the section that is being written

  // The open chunk.
  std::string chunk_;
  std::uint64_t chunk_start_ns_ = 0;
  std::uint64_t chunk_end_ns_ = 0;
  std::map<std::uint16_t, std::vector<IndexEntry>> chunk_index_;

  // For the summary: whole records, in order.
  std::vector<std::string> schemas_;
  std::vector<std::string> channels_;
  std::vector<std::string> chunk_indexes_;
  std::vector<std::string> attachment_indexes_;
  std::vector<std::string> metadata_indexes_;
  std::map<std::uint16_t, std::uint64_t> message_counts_;
  std::uint64_t message_count_ = 0;
  std::uint64_t start_ns_ = 0;
  std::uint64_t end_ns_ = 0;
};

}  // namespace runtime::mcap
