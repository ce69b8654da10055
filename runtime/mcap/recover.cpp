#include "runtime/mcap/recover.h"

#include <algorithm>
#include <map>
#include <utility>

#include "runtime/mcap/mcap_file.h"
#include "runtime/mcap/mcap_writer.h"
#include "runtime/mcap/new_file.h"
#include "runtime/program/build_info.h"
#include "runtime/program/printable.h"

namespace runtime::mcap {
namespace {

/// The beginning of a text, up to the end of a character.
std::string quoted(std::string_view text) {
  std::size_t bytes = 40;
  if (text.size() <= bytes) return printable(text);
  while (bytes > 0 && (static_cast<unsigned char>(text[bytes]) & 0xC0U) == 0x80) --bytes;
  return printable(text.substr(0, bytes)) + "…";
}

/// The texts of one record. MCAP's are UTF-8, and other programs refuse a file with one that is not.
class Texts {
 public:
  std::string mended(std::string_view text) {
    if (is_utf8(text)) return std::string(text);
    if (damaged_.empty()) damaged_ = quoted(text);
    return printable(text);
  }
  StringMap mended(const StringMap& map) {
    StringMap result;
    for (const auto& [key, value] : map) result[mended(key)] = mended(value);
    return result;
  }
  /// To be called when the record is written. @throws BadRecord, which reports its place.
  void report() const {
    if (!damaged_.empty()) throw BadRecord("a text is not UTF-8; written as " + damaged_);
  }

 private:
  std::string damaged_;  // the first of them
};

/// Repeats each record in a new file.
class Copy : public Visitor {
 public:
  Copy(McapWriter& writer, Recovered& result) : writer_(writer), result_(result) {}

 private:
  void header(std::string_view profile, std::string_view) override {
    Texts texts;
    (void)texts.mended(profile);
    texts.report();
  }
  void schema(const Schema& schema) override {
    Texts texts;
    schemas_[schema.id] =
        writer_.add_schema(texts.mended(schema.name), texts.mended(schema.encoding), schema.data);
    texts.report();
  }
  void channel(const Channel& channel) override {
    const std::uint16_t schema = channel.schema == 0 ? std::uint16_t{0} : schemas_.at(channel.schema);
    Texts texts;
    channels_[channel.id] =
        writer_.add_channel(schema, texts.mended(channel.topic), texts.mended(channel.message_encoding),
                            texts.mended(channel.metadata));
    texts.report();
  }
  void message(const Message& message) override {
    Message copy = message;
    copy.channel = channels_.at(message.channel);
    writer_.add_message(copy);
    first_ns_ = result_.messages == 0 ? message.log_time_ns : std::min(first_ns_, message.log_time_ns);
    last_ns_ = std::max(last_ns_, message.log_time_ns);
    result_.duration_s = static_cast<double>(last_ns_ - first_ns_) * 1e-9;
    ++result_.messages;
  }
  void metadata(std::string_view name, const StringMap& metadata) override {
    Texts texts;
    writer_.add_metadata(texts.mended(name), texts.mended(metadata));
    texts.report();
  }
  void attachment(const Attachment& attachment) override {
    Texts texts;
    Attachment copy = attachment;
    copy.name = texts.mended(attachment.name);
    copy.media_type = texts.mended(attachment.media_type);
    writer_.add_attachment(copy);
    texts.report();
  }
  bool wants_attachments() const override { return true; }
  void damaged(const McapError& error) override {
    ++result_.damaged_records;
    result_.list(error);
  }

  McapWriter& writer_;
  Recovered& result_;
  std::map<std::uint16_t, std::uint16_t> schemas_;  // from the identifiers of the old file
  std::map<std::uint16_t, std::uint16_t> channels_;
  std::uint64_t first_ns_ = 0;
  std::uint64_t last_ns_ = 0;
};

/// The header comes first in both files, so it is read before the new one begins. A damaged one has no
/// profile.
class Profile : public Visitor {
 public:
  std::string profile;
  bool wants_more() const override { return !seen_; }

 private:
  void header(std::string_view text, std::string_view) override {
    profile = Texts().mended(text);
    seen_ = true;
  }
  void schema(const Schema&) override { seen_ = true; }
  void channel(const Channel&) override { seen_ = true; }
  void metadata(std::string_view, const StringMap&) override { seen_ = true; }
  void damaged(const McapError&) override { seen_ = true; }

  bool seen_ = false;
};

}  // namespace

Recovered recover(const std::function<ReadBytes()>& open, const std::string& file, const std::string& library,
                  const std::function<void(std::string_view)>& write) {
  Profile first;
  try {
    read_mcap(open(), file, first);
  } catch (const TornMcap&) {  // reported below
  }
  McapWriter writer(write, {.profile = first.profile, .library = library});
  Recovered result;
  Copy copy(writer, result);
  try {
    read_mcap(open(), file, copy);
  } catch (const TornMcap& error) {
    result.list(error);
    result.torn_at = error.offset();
  }
  writer.finish();
  return result;
}

Recovered recover(const std::filesystem::path& in, const std::filesystem::path& out) {
  read_file(in);  // refuses a missing file before the new one exists
  NewFile file(out);
  Recovered result =
      recover([&in] { return read_file(in); }, in.string(), std::string("youbot-hal ") + build_version(),
              [&file](std::string_view bytes) { file.write(bytes); });
  file.finish();
  return result;
}

}  // namespace runtime::mcap
