#include "runtime/mcap/mcap_writer.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include "runtime/mcap/crc32.h"

namespace runtime::mcap {
namespace {

void append_record(std::string& out, Opcode opcode, std::string_view content) {
  out += static_cast<char>(opcode);
  append_number(out, static_cast<std::uint64_t>(content.size()));
  out += content;
}

void append_bytes(std::string& out, std::string_view bytes) {
  append_number(out, static_cast<std::uint64_t>(bytes.size()));
  out += bytes;
}

/// Identifiers are counted from 1; a schema's 0 means none.
std::uint16_t next_id(const std::vector<std::string>& records, const char* what) {
  if (records.size() >= std::numeric_limits<std::uint16_t>::max())
    throw std::length_error(std::string("MCAP: more than 65535 ") + what);
  return static_cast<std::uint16_t>(records.size() + 1);
}

}  // namespace

McapWriter::McapWriter(std::function<void(std::string_view)> write, WriterOptions options)
    : write_(std::move(write)), options_(std::move(options)) {
  std::string head(kMagic);
  std::string content;
  append_string(content, options_.profile);
  append_string(content, options_.library);
  append_record(head, Opcode::kHeader, content);
  this->write(head);
}

void McapWriter::write(std::string_view bytes) {
  if (ending_)
    *ending_ += bytes;
  else
    write_(bytes);
  position_ += bytes.size();
  crc_ = crc32(bytes, crc_);
}

void McapWriter::write_record(Opcode opcode, std::string_view content) {
  std::string record;
  append_record(record, opcode, content);
  write(record);
}

std::uint16_t McapWriter::add_schema(std::string_view schema_name, std::string_view encoding,
                                     std::string_view data) {
  const std::uint16_t id = next_id(schemas_, "schemas");
  std::string content;
  append_number(content, id);
  append_string(content, schema_name);
  append_string(content, encoding);
  append_string(content, data);
  write_record(Opcode::kSchema, content);
  schemas_.push_back(std::move(content));
  return id;
}

std::uint16_t McapWriter::add_channel(std::uint16_t schema, std::string_view topic,
                                      std::string_view message_encoding, const StringMap& metadata) {
  const std::uint16_t id = next_id(channels_, "channels");
  std::string content;
  append_number(content, id);
  append_number(content, schema);
  append_string(content, topic);
  append_string(content, message_encoding);
  append_map(content, metadata);
  write_record(Opcode::kChannel, content);
  channels_.push_back(std::move(content));
  return id;
}

void McapWriter::add_message(const Message& message) {
  const std::uint64_t time_ns = message.log_time_ns;
  const auto period_ns = static_cast<std::uint64_t>(options_.chunk_period.count());
  if (!chunk_.empty() && time_ns > chunk_start_ns_ && time_ns - chunk_start_ns_ >= period_ns) end_chunk();
  if (chunk_.empty()) chunk_start_ns_ = chunk_end_ns_ = time_ns;
  chunk_start_ns_ = std::min(chunk_start_ns_, time_ns);
  chunk_end_ns_ = std::max(chunk_end_ns_, time_ns);
  chunk_index_[message.channel].push_back({time_ns, chunk_.size()});

  chunk_ += static_cast<char>(Opcode::kMessage);
  append_number(chunk_, std::uint64_t{2 + 4 + 8 + 8} + message.data.size());
  append_number(chunk_, message.channel);
  append_number(chunk_, message.sequence);
  append_number(chunk_, time_ns);
  append_number(chunk_, message.publish_time_ns);
  chunk_ += message.data;

  if (chunk_.size() >= options_.chunk_bytes) end_chunk();
}

void McapWriter::end_chunk() {
  if (chunk_.empty()) return;
  const std::string_view compression = name(options_.compression);
  const std::string records = compress(options_.compression, chunk_);
  std::string content;
  append_number(content, chunk_start_ns_);
  append_number(content, chunk_end_ns_);
  append_number(content, static_cast<std::uint64_t>(chunk_.size()));
  append_number(content, crc32(chunk_));
  append_string(content, compression);
  append_bytes(content, records);

  const std::uint64_t chunk_offset = position_;
  std::string out;
  append_record(out, Opcode::kChunk, content);
  const std::uint64_t chunk_length = out.size();
  std::string index_offsets;
  for (const auto& [channel, entries] : chunk_index_) {
    append_number(index_offsets, channel);
    append_number(index_offsets, chunk_offset + out.size());
    std::string times;
    for (const IndexEntry& entry : entries) {
      append_number(times, entry.log_time_ns);
      append_number(times, entry.offset);
    }
    std::string index;
    append_number(index, channel);
    append_string(index, times);
    append_record(out, Opcode::kMessageIndex, index);
  }

  std::string summary;
  append_number(summary, chunk_start_ns_);
  append_number(summary, chunk_end_ns_);
  append_number(summary, chunk_offset);
  append_number(summary, chunk_length);
  append_string(summary, index_offsets);
  append_number(summary, static_cast<std::uint64_t>(out.size()) - chunk_length);
  append_string(summary, compression);
  append_number(summary, static_cast<std::uint64_t>(records.size()));
  append_number(summary, static_cast<std::uint64_t>(chunk_.size()));
  // Cleared first: after a failed write the next chunk does not repeat these messages.
  chunk_.clear();
  const auto index = std::exchange(chunk_index_, {});
  write(out);
  chunk_indexes_.push_back(std::move(summary));
  count_chunk(index);
}

void McapWriter::count_chunk(const std::map<std::uint16_t, std::vector<IndexEntry>>& index) {
  start_ns_ = message_count_ == 0 ? chunk_start_ns_ : std::min(start_ns_, chunk_start_ns_);
  end_ns_ = std::max(end_ns_, chunk_end_ns_);
  for (const auto& [channel, entries] : index) {
    message_counts_[channel] += entries.size();
    message_count_ += entries.size();
  }
}

void McapWriter::add_metadata(std::string_view metadata_name, const StringMap& metadata) {
  end_chunk();
  std::string content;
  append_string(content, metadata_name);
  append_map(content, metadata);
  std::string index;
  append_number(index, position_);
  append_number(index, static_cast<std::uint64_t>(kRecordHeadBytes + content.size()));
  append_string(index, metadata_name);
  write_record(Opcode::kMetadata, content);
  metadata_indexes_.push_back(std::move(index));
}

void McapWriter::add_attachment(const Attachment& attachment) {
  end_chunk();
  std::string content;
  append_number(content, attachment.log_time_ns);
  append_number(content, attachment.create_time_ns);
  append_string(content, attachment.name);
  append_string(content, attachment.media_type);
  append_bytes(content, attachment.data);
  append_number(content, crc32(content));
  std::string index;
  append_number(index, position_);
  append_number(index, static_cast<std::uint64_t>(kRecordHeadBytes + content.size()));
  append_number(index, attachment.log_time_ns);
  append_number(index, attachment.create_time_ns);
  append_number(index, static_cast<std::uint64_t>(attachment.data.size()));
  append_string(index, attachment.name);
  append_string(index, attachment.media_type);
  write_record(Opcode::kAttachment, content);
  attachment_indexes_.push_back(std::move(index));
}

std::string McapWriter::statistics() const {
  std::string content;
  append_number(content, message_count_);
  append_number(content, static_cast<std::uint16_t>(schemas_.size()));
  append_number(content, static_cast<std::uint32_t>(channels_.size()));
  append_number(content, static_cast<std::uint32_t>(attachment_indexes_.size()));
  append_number(content, static_cast<std::uint32_t>(metadata_indexes_.size()));
  append_number(content, static_cast<std::uint32_t>(chunk_indexes_.size()));
  append_number(content, start_ns_);
  append_number(content, end_ns_);
  std::string counts;
  for (const auto& [channel, count] : message_counts_) {
    append_number(counts, channel);
    append_number(counts, count);
  }
  append_string(content, counts);
  return content;
}

void McapWriter::finish() {
  end_chunk();
  ending_.emplace();
  std::string data_end;
  append_number(data_end, crc_);
  write_record(Opcode::kDataEnd, data_end);

  const std::uint64_t summary_start = position_;
  crc_ = 0;
  std::string offsets;
  const auto group = [&](Opcode opcode, const std::vector<std::string>& contents) {
    if (contents.empty()) return;
    const std::uint64_t start = position_;
    for (const std::string& content : contents) write_record(opcode, content);
    std::string offset;
    offset += static_cast<char>(opcode);
    append_number(offset, start);
    append_number(offset, position_ - start);
    append_record(offsets, Opcode::kSummaryOffset, offset);
  };
  group(Opcode::kSchema, schemas_);
  group(Opcode::kChannel, channels_);
  group(Opcode::kStatistics, {statistics()});
  group(Opcode::kChunkIndex, chunk_indexes_);
  group(Opcode::kAttachmentIndex, attachment_indexes_);
  group(Opcode::kMetadataIndex, metadata_indexes_);
  const std::uint64_t summary_offset_start = position_;
  write(offsets);

  // The footer's checksum covers the summary and the footer up to itself.
  std::string footer;
  footer += static_cast<char>(Opcode::kFooter);
  append_number(footer, std::uint64_t{8 + 8 + 4});
  append_number(footer, summary_start);
  append_number(footer, summary_offset_start);
  append_number(footer, crc32(footer, crc_));
  write(footer + std::string(kMagic));
  write_(*ending_);
}

}  // namespace runtime::mcap
