/// @file
/// Reads MCAP files of any writer: chunked or not, with or without summary; unknown records are skipped.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "runtime/configuration/toml_reader.h"
#include "runtime/mcap/bytes.h"
#include "runtime/mcap/format.h"
#include "runtime/mcap/mcap_writer.h"

namespace runtime::mcap {

/// A file that is not valid MCAP. The message contains file name and byte offset.
class McapError : public ConfigError {
 public:
  McapError(const std::string& file, std::uint64_t offset, const std::string& problem)
      : ConfigError({file + ": byte " + std::to_string(offset) + ": " + problem}), offset_(offset) {}
  std::uint64_t offset() const noexcept { return offset_; }

 private:
  std::uint64_t offset_;
};

/// A file that ends before its data section does, as an interrupted writer leaves it: recover() reads what is
/// there.
class TornMcap : public McapError {
 public:
  using McapError::McapError;
};

/// Fills a buffer and returns the number of bytes; 0 at the end.
using ReadBytes = std::function<std::size_t(char* buffer, std::size_t size)>;

ReadBytes read_from(std::string_view bytes);

struct Schema {
  std::uint16_t id = 0;  ///< never 0
  std::string_view name;
  std::string_view encoding;
  std::string_view data;
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema = 0;  ///< 0: none
  std::string_view topic;
  std::string_view message_encoding;
  StringMap metadata;
};

/// Gets the records of the data section in the order of the file. Views are valid during the call. A schema
/// precedes its channels, a channel its messages; a repetition of an id is not passed on.
class Visitor {
 public:
  Visitor() = default;
  Visitor(const Visitor&) = delete;
  Visitor& operator=(const Visitor&) = delete;
  virtual ~Visitor() = default;
  virtual void header(std::string_view /*profile*/, std::string_view /*library*/) {}
  virtual void schema(const Schema&) {}
  virtual void channel(const Channel&) {}
  virtual void message(const Message&) {}
  virtual void metadata(std::string_view /*name*/, const StringMap&) {}
  virtual void attachment(const Attachment&) {}
  /// Attachments may be large: only a visitor that wants them gets them.
  virtual bool wants_attachments() const { return false; }
  /// Reading ends when this is false.
  virtual bool wants_more() const { return true; }
  /// A record that is complete, but damaged. The next one follows if this returns; by default it throws.
  virtual void damaged(const McapError& error) { throw error; }
};

/// Reads from the beginning to the end of the data section, and validates all checksums. Of a torn chunk the
/// complete messages are visited before the exception.
/// @throws TornMcap; McapError, naming file and byte offset, if it is no MCAP file. What precedes has been
/// visited.
void read_mcap(const ReadBytes& read, const std::string& file, Visitor& visitor);

}  // namespace runtime::mcap
