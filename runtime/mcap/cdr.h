/// @file
/// CDR, the serialization of ROS 2 messages (XCDR version 1, OMG DDS-XTypes 7.4.1): each number is aligned to
/// its size, counted from the end of the four-byte head.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "runtime/mcap/bytes.h"

namespace runtime::mcap {

/// Writes little-endian payloads.
///
///     CdrWriter cdr;
///     cdr.number(std::int32_t{5});
///     cdr.string("wheel_1");
///     message.data = cdr.payload();
class CdrWriter {
 public:
  CdrWriter() { clear(); }

  /// Begins the next payload in the same memory.
  void clear() { out_.assign({'\0', '\1', '\0', '\0'}); }

  void number(std::uint8_t value) { aligned(value); }
  void number(std::uint32_t value) { aligned(value); }
  void number(std::int32_t value) { aligned(static_cast<std::uint32_t>(value)); }
  void number(std::int64_t value) { aligned(static_cast<std::uint64_t>(value)); }
  void number(double value) { aligned(std::bit_cast<std::uint64_t>(value)); }
  /// The length counts the final zero.
  void string(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size() + 1));
    out_ += text;
    out_ += '\0';
  }
  /// The number of elements, which precedes those of a sequence.
  void count(std::size_t elements) { number(static_cast<std::uint32_t>(elements)); }

  std::string_view payload() const noexcept { return out_; }

 private:
  template <typename Number>
  void aligned(Number value) {
    while ((out_.size() - kCdrHeadBytes) % sizeof value != 0) out_ += '\0';
    append_number(out_, value);
  }

  static constexpr std::size_t kCdrHeadBytes = 4;
  std::string out_;
};

/// Reads payloads of either byte order. Each function throws BadRecord if the payload ends.
class CdrReader {
 public:
  /// @throws BadRecord for another encoding, such as XCDR version 2.
  explicit CdrReader(std::string_view payload) : fields_(payload) {
    const std::string_view head = fields_.bytes(4, "CDR head");
    if (head[0] != 0 || (head[1] != 0 && head[1] != 1))
      throw BadRecord("the payload is not plain CDR: its head is " +
                      std::to_string(static_cast<unsigned char>(head[0])) + " " +
                      std::to_string(static_cast<unsigned char>(head[1])));
    big_endian_ = head[1] == 0;
    size_ = fields_.left().size();
  }

  std::uint32_t uint32(const char* field) { return aligned<std::uint32_t>(field); }
  std::int32_t int32(const char* field) { return static_cast<std::int32_t>(uint32(field)); }
  std::int64_t int64(const char* field) { return static_cast<std::int64_t>(aligned<std::uint64_t>(field)); }
  double float64(const char* field) { return std::bit_cast<double>(aligned<std::uint64_t>(field)); }
  std::string_view string(const char* field) {
    std::string_view text = fields_.bytes(uint32(field), field);
    if (text.ends_with('\0')) text.remove_suffix(1);
    return text;
  }
  /// The number of elements of a sequence; refuses more than the payload can hold.
  std::size_t count(const char* field, std::size_t least_bytes_of_element) {
    const std::size_t elements = uint32(field);
    if (elements > fields_.left().size() / least_bytes_of_element)
      throw BadRecord(std::string(field) + " has " + std::to_string(elements) + " elements, but only " +
                      std::to_string(fields_.left().size()) + " bytes are left");
    return elements;
  }

 private:
  template <typename Number>
  Number aligned(const char* field) {
    const std::size_t used = size_ - fields_.left().size();
    fields_.bytes((sizeof(Number) - used % sizeof(Number)) % sizeof(Number), field);
    const auto value = fields_.number<Number>(field);
    if (!big_endian_) return value;
    Number swapped = 0;
    for (std::size_t i = 0; i < sizeof value; ++i)
      swapped = static_cast<Number>(swapped << 8 | ((value >> (8 * i)) & 0xff));
    return swapped;
  }

  Fields fields_;
  std::size_t size_ = 0;
  bool big_endian_ = false;
};

}  // namespace runtime::mcap
