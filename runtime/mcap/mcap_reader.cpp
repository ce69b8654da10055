#include "runtime/mcap/mcap_reader.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "runtime/mcap/compression.h"
#include "runtime/mcap/crc32.h"

namespace runtime::mcap {
namespace {

/// The buffer grows step by step: a stated length alone reserves no memory.
constexpr std::size_t kPieceBytes = std::size_t{64} << 10;

/// The file as a sequence of bytes, with offset and checksum.
class Input {
 public:
  explicit Input(const ReadBytes& read) : read_(read) {}

  /// `count` bytes, or those up to the end of the file.
  void take(std::uint64_t count, std::string& out) {
    out.clear();
    while (out.size() < count) {
      const std::size_t used = out.size();
      out.resize(static_cast<std::size_t>(std::min<std::uint64_t>(count, used + kPieceBytes)));
      const std::size_t got = read_(out.data() + used, out.size() - used);
      out.resize(used + got);
      if (got == 0) break;
    }
    note(out);
  }
  /// False if the file ends before.
  bool skip(std::uint64_t count) {
    while (count > 0) {
      piece_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(count, kPieceBytes)));
      const std::size_t got = read_(piece_.data(), piece_.size());
      note(std::string_view(piece_).substr(0, got));
      if (got == 0) return false;
      count -= got;
    }
    return true;
  }
  std::uint64_t offset() const { return offset_; }
  /// Of everything before the last take().
  std::uint32_t crc_before() const { return crc_before_; }

 private:
  void note(std::string_view bytes) {
    crc_before_ = crc_;
    crc_ = crc32(bytes, crc_);
    offset_ += bytes.size();
  }

  const ReadBytes& read_;
  std::string piece_;
  std::uint64_t offset_ = 0;
  std::uint32_t crc_ = 0;
  std::uint32_t crc_before_ = 0;
};

class Reader {
 public:
  Reader(const ReadBytes& read, const std::string& file, Visitor& visitor)
      : input_(read), file_(file), visitor_(visitor) {}

  void read() {
    input_.take(kMagic.size(), content_);
    if (content_ != kMagic) throw McapError(file_, 0, "this is not an MCAP file, version 1");
    while (visitor_.wants_more() && next_record()) {
    }
  }

 private:
  [[noreturn]] void fail_torn(std::uint64_t offset, std::uint64_t length) const {
    throw TornMcap(file_, offset, "the file ends in a record of " + std::to_string(length) + " bytes");
  }

  /// False after the end of the data section.
  bool next_record() {
    const std::uint64_t at = input_.offset();
    std::string head;
    input_.take(kRecordHeadBytes, head);
    if (head.size() < kRecordHeadBytes)
      throw TornMcap(file_, at, "the file ends here, but its data section does not: it was not finished");
    Fields fields(head);
    const auto opcode = static_cast<Opcode>(fields.number<std::uint8_t>("opcode"));
    const auto length = fields.number<std::uint64_t>("length");
    if (opcode == Opcode::kFooter)
      throw TornMcap(file_, at, "the footer comes before the end of the data section");
    if (opcode == Opcode{0})  // such as the zeros that a power cut leaves
      throw TornMcap(file_, at, "the records end here: the next one has the opcode 0, which no record has");
    const std::uint32_t crc_of_data = input_.crc_before();
    if (!is_wanted(opcode)) {
      if (!input_.skip(length)) fail_torn(at, length);
    } else if (length > kMaxRecordBytes) {
      if (!input_.skip(length)) fail_torn(at, length);
      visitor_.damaged(McapError(file_, at,
                                 "a record of " + std::to_string(length) + " bytes, but at most " +
                                     std::to_string(kMaxRecordBytes) + " are read"));
    } else {
      input_.take(length, content_);
      const bool torn = content_.size() < length;
      if (opcode == Opcode::kDataEnd && !torn) {
        data_end(at, crc_of_data);
        return false;
      }
      if (!torn) {
        guarded(at, [&] { record(opcode, content_, at); });
      } else {
        if (opcode == Opcode::kChunk) torn_chunk(at);
        fail_torn(at, length);
      }
    }
    return true;
  }

  bool is_wanted(Opcode opcode) const {
    switch (opcode) {
      case Opcode::kHeader:
      case Opcode::kSchema:
      case Opcode::kChannel:
      case Opcode::kMessage:
      case Opcode::kChunk:
      case Opcode::kMetadata:
      case Opcode::kDataEnd: return true;
      case Opcode::kAttachment: return visitor_.wants_attachments();
      default: return false;
    }
  }

  /// Passes problems of one record to the visitor, with its offset.
  template <typename Call>
  void guarded(std::uint64_t at, Call call) {
    try {
      call();
    } catch (const BadRecord& error) {
      visitor_.damaged(McapError(file_, at, std::string("a damaged record: ") + error.what()));
    }
  }

  void record(Opcode opcode, std::string_view content, std::uint64_t at) {
    Fields fields(content);
    switch (opcode) {
      case Opcode::kHeader: {
        const std::string_view profile = fields.string("profile");
        visitor_.header(profile, fields.string("library"));
        break;
      }
      case Opcode::kSchema: schema(fields); break;
      case Opcode::kChannel: channel(fields); break;
      case Opcode::kMessage: message(fields); break;
      case Opcode::kChunk: chunk(fields, at); break;
      case Opcode::kMetadata: {
        const std::string_view metadata_name = fields.string("name");
        visitor_.metadata(metadata_name, fields.map("metadata"));
        break;
      }
      case Opcode::kAttachment: attachment(content); break;
      default: break;
    }
  }

  void schema(Fields& fields) {
    Schema schema;
    schema.id = fields.number<std::uint16_t>("schema id");
    schema.name = fields.string("schema name");
    schema.encoding = fields.string("schema encoding");
    schema.data = fields.string("schema data");
    if (schema.id == 0) throw BadRecord("a schema with the id 0");
    if (schemas_.insert(schema.id).second) visitor_.schema(schema);
  }

  void channel(Fields& fields) {
    Channel channel;
    channel.id = fields.number<std::uint16_t>("channel id");
    channel.schema = fields.number<std::uint16_t>("schema id");
    channel.topic = fields.string("topic");
    channel.message_encoding = fields.string("message encoding");
    channel.metadata = fields.map("channel metadata");
    if (channel.schema != 0 && !schemas_.contains(channel.schema))
      throw BadRecord("channel " + std::to_string(channel.id) + " without its schema");
    if (channels_.insert(channel.id).second) visitor_.channel(channel);
  }

  void message(Fields& fields) {
    Message message;
    message.channel = fields.number<std::uint16_t>("channel id");
    message.sequence = fields.number<std::uint32_t>("sequence");
    message.log_time_ns = fields.number<std::uint64_t>("log time");
    message.publish_time_ns = fields.number<std::uint64_t>("publish time");
    message.data = fields.left();
    if (!channels_.contains(message.channel))
      throw BadRecord("a message without its channel " + std::to_string(message.channel));
    visitor_.message(message);
  }

  struct ChunkHead {
    std::uint64_t size;
    std::uint32_t crc;
    std::string_view compression;
  };
  static ChunkHead chunk_head(Fields& fields) {
    fields.number<std::uint64_t>("start time");
    fields.number<std::uint64_t>("end time");
    ChunkHead head{};
    head.size = fields.number<std::uint64_t>("uncompressed size");
    head.crc = fields.number<std::uint32_t>("uncompressed CRC");
    head.compression = fields.string("compression");
    if (head.size > kMaxRecordBytes)
      throw BadRecord("a chunk of " + std::to_string(head.size) + " bytes, but at most " +
                      std::to_string(kMaxRecordBytes) + " are read");
    return head;
  }

  void chunk(Fields& fields, std::uint64_t at) {
    const ChunkHead head = chunk_head(fields);
    const std::string_view raw = fields.bytes(fields.number<std::uint64_t>("records"), "records");
    const std::string records = unpacked(head, raw);
    if (records.size() != head.size)
      throw BadRecord("a chunk of " + std::to_string(records.size()) + " bytes, which states " +
                      std::to_string(head.size));
    if (head.crc != 0 && crc32(records) != head.crc) throw BadRecord("the checksum of a chunk is wrong");
    if (!chunk_records(records, at)) throw BadRecord("a chunk ends in a record");
  }

  /// Visits what can be read of a chunk that is cut off, without its checksum.
  void torn_chunk(std::uint64_t at) {
    try {
      Fields fields(content_);
      const ChunkHead head = chunk_head(fields);
      fields.number<std::uint64_t>("records");
      chunk_records(unpacked(head, fields.left()), at);
    } catch (const BadRecord&) {  // the caller reports the torn file
    }
  }

  static std::string unpacked(const ChunkHead& head, std::string_view raw) {
    try {
      return decompress(head.compression, raw, head.size);
    } catch (const std::runtime_error& error) {
      throw BadRecord(error.what());
    }
  }

  /// Passes on each record by itself, damaged ones too. False if the last one is not complete.
  bool chunk_records(std::string_view records, std::uint64_t at) {
    for (Fields fields(records); !fields.left().empty() && visitor_.wants_more();) {
      if (fields.left().size() < kRecordHeadBytes) return false;
      const auto opcode = static_cast<Opcode>(fields.number<std::uint8_t>("opcode"));
      const auto length = fields.number<std::uint64_t>("length");
      if (length > fields.left().size()) return false;
      const std::string_view content = fields.bytes(length, "record");
      if (opcode == Opcode::kSchema || opcode == Opcode::kChannel || opcode == Opcode::kMessage)
        guarded(at, [&] { record(opcode, content, at); });
    }
    return true;
  }

  void attachment(std::string_view content) {
    Fields fields(content);
    Attachment attachment;
    attachment.log_time_ns = fields.number<std::uint64_t>("log time");
    attachment.create_time_ns = fields.number<std::uint64_t>("create time");
    attachment.name = fields.string("name");
    attachment.media_type = fields.string("media type");
    attachment.data = fields.bytes(fields.number<std::uint64_t>("data"), "data");
    const std::string_view covered = content.substr(0, content.size() - fields.left().size());
    const auto crc = fields.number<std::uint32_t>("CRC");
    if (crc != 0 && crc != crc32(covered)) throw BadRecord("the checksum of an attachment is wrong");
    visitor_.attachment(attachment);
  }

  void data_end(std::uint64_t at, std::uint32_t crc_of_data) {
    guarded(at, [&] {
      const auto crc = Fields(content_).number<std::uint32_t>("data section CRC");
      if (crc != 0 && crc != crc_of_data) throw BadRecord("the checksum of the data section is wrong");
    });
  }

  Input input_;
  const std::string& file_;
  Visitor& visitor_;
  std::string content_;
  std::set<std::uint16_t> schemas_;
  std::set<std::uint16_t> channels_;
};

}  // namespace

ReadBytes read_from(std::string_view bytes) {
  return [bytes](char* buffer, std::size_t size) mutable {
    const std::size_t count = std::min(size, bytes.size());
    std::copy_n(bytes.data(), count, buffer);
    bytes.remove_prefix(count);
    return count;
  };
}

void read_mcap(const ReadBytes& read, const std::string& file, Visitor& visitor) {
  Reader(read, file, visitor).read();
}

}  // namespace runtime::mcap
