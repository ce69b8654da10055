#include "runtime/mcap/recover.h"

#include <algorithm>
#include <map>
#include <utility>

#include "runtime/mcap/mcap_file.h"
#include "runtime/mcap/mcap_writer.h"
#include "runtime/mcap/new_file.h"
#include "runtime/program/build_info.h"

namespace runtime::mcap {
namespace {

/// Repeats each record in a new file.
class Copy : public Visitor {
 public:
  Copy(McapWriter& writer, Recovered& result) : writer_(writer), result_(result) {}

 private:
  void schema(const Schema& schema) override {
    schemas_[schema.id] = writer_.add_schema(schema.name, schema.encoding, schema.data);
  }
  void channel(const Channel& channel) override {
    const std::uint16_t schema = channel.schema == 0 ? std::uint16_t{0} : schemas_.at(channel.schema);
    channels_[channel.id] =
        writer_.add_channel(schema, channel.topic, channel.message_encoding, channel.metadata);
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
    writer_.add_metadata(name, metadata);
  }
  void attachment(const Attachment& attachment) override { writer_.add_attachment(attachment); }
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
    profile = text;
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
