/// @file
/// A structure of Apache Thrift's compact protocol
/// (https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md).
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace runtime::parquet {

/// Fields in increasing order of their ids, with those types that Parquet's metadata need.
///
///     const std::string bytes = ThriftStruct().i32(1, 2).text(4, "element").bytes();
class ThriftStruct {
 public:
  ThriftStruct& i32(int id, std::int32_t value);
  ThriftStruct& i64(int id, std::int64_t value);
  ThriftStruct& text(int id, std::string_view value);
  ThriftStruct& structure(int id, const ThriftStruct& value);
  ThriftStruct& i32_list(int id, std::span<const std::int32_t> values);
  ThriftStruct& text_list(int id, std::span<const std::string> values);
  ThriftStruct& structure_list(int id, std::span<const ThriftStruct> values);

  std::string bytes() const { return fields_ + '\0'; }

 private:
  enum class Type : std::uint8_t { kI32 = 5, kI64 = 6, kBinary = 8, kList = 9, kStruct = 12 };

  void begin_field(int id, Type type);
  void begin_list(int id, std::size_t size, Type elements);
  void append_signed(std::int64_t value);
  void append_text(std::string_view value);

  std::string fields_;
  int last_id_ = 0;
};

/// Seven bits a byte, lowest first.
void append_varint(std::string& out, std::uint64_t value);

}  // namespace runtime::parquet
