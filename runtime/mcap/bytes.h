/// @file
/// Little-endian numbers, strings and maps of MCAP records, as in "Serialization" of the specification.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

namespace runtime::mcap {

/// Strings that a file attaches to a channel or to itself.
using StringMap = std::map<std::string, std::string>;

/// A record whose content is wrong, such as shorter than its fields. The reader adds file name and offset.
class BadRecord : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

template <typename Number>
void append_number(std::string& out, Number value) {
  static_assert(std::is_unsigned_v<Number>);
  for (std::size_t i = 0; i < sizeof value; ++i) out += static_cast<char>((value >> (8 * i)) & 0xff);
}

inline void append_string(std::string& out, std::string_view text) {
  append_number(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

inline void append_map(std::string& out, const StringMap& map) {
  std::string entries;
  for (const auto& [key, value] : map) {
    append_string(entries, key);
    append_string(entries, value);
  }
  append_string(out, entries);
}

/// Takes fields from the front of a record. Each function throws BadRecord, naming the field, if the bytes
/// end.
class Fields {
 public:
  explicit Fields(std::string_view bytes) noexcept : left_(bytes) {}

  std::string_view left() const noexcept { return left_; }

  std::string_view bytes(std::uint64_t count, const char* field) {
    if (count > left_.size())
      throw BadRecord(std::string(field) + " has " + std::to_string(count) + " bytes, but only " +
                      std::to_string(left_.size()) + " are left");
    const std::string_view taken = left_.substr(0, static_cast<std::size_t>(count));
    left_.remove_prefix(taken.size());
    return taken;
  }
  template <typename Number>
  Number number(const char* field) {
    Number value = 0;
    const std::string_view raw = bytes(sizeof value, field);
    for (std::size_t i = 0; i < sizeof value; ++i)
      value = static_cast<Number>(value | static_cast<Number>(static_cast<unsigned char>(raw[i])) << (8 * i));
    return value;
  }
  std::string_view string(const char* field) { return bytes(number<std::uint32_t>(field), field); }
  StringMap map(const char* field) {
    StringMap map;
    for (Fields entries(string(field)); !entries.left_.empty();) {
      std::string key(entries.string(field));
      map.insert_or_assign(std::move(key), std::string(entries.string(field)));
    }
    return map;
  }

 private:
  std::string_view left_;
};

}  // namespace runtime::mcap
