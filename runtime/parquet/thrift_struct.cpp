#include "runtime/parquet/thrift_struct.h"

#include <stdexcept>

namespace runtime::parquet {

void append_varint(std::string& out, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) out += static_cast<char>(value | 0x80);
  out += static_cast<char>(value);
}

ThriftStruct& ThriftStruct::i32(int id, std::int32_t value) {
  begin_field(id, Type::kI32);
  append_signed(value);
  return *this;
}

ThriftStruct& ThriftStruct::i64(int id, std::int64_t value) {
  begin_field(id, Type::kI64);
  append_signed(value);
  return *this;
}

ThriftStruct& ThriftStruct::text(int id, std::string_view value) {
  begin_field(id, Type::kBinary);
  append_text(value);
  return *this;
}

ThriftStruct& ThriftStruct::structure(int id, const ThriftStruct& value) {
  begin_field(id, Type::kStruct);
  fields_ += value.bytes();
  return *this;
}

ThriftStruct& ThriftStruct::i32_list(int id, std::span<const std::int32_t> values) {
  begin_list(id, values.size(), Type::kI32);
  for (const std::int32_t value : values) append_signed(value);
  return *this;
}

ThriftStruct& ThriftStruct::text_list(int id, std::span<const std::string> values) {
  begin_list(id, values.size(), Type::kBinary);
  for (const std::string& value : values) append_text(value);
  return *this;
}

ThriftStruct& ThriftStruct::structure_list(int id, std::span<const ThriftStruct> values) {
  begin_list(id, values.size(), Type::kStruct);
  for (const ThriftStruct& value : values) fields_ += value.bytes();
  return *this;
}

void ThriftStruct::begin_field(int id, Type type) {
  const int step = id - last_id_;
  // Thrift has another form for longer steps; no structure of Parquet needs it.
  if (step < 1 || step > 15) throw std::logic_error("ThriftStruct: field " + std::to_string(id));
  fields_ += static_cast<char>(step << 4 | static_cast<int>(type));
  last_id_ = id;
}

void ThriftStruct::begin_list(int id, std::size_t size, Type elements) {
  constexpr std::size_t kLongList = 15;  // its size follows as a number of its own
  begin_field(id, Type::kList);
  const std::size_t short_size = size < kLongList ? size : kLongList;
  fields_ += static_cast<char>(short_size << 4 | static_cast<std::size_t>(elements));
  if (short_size == kLongList) append_varint(fields_, size);
}

void ThriftStruct::append_signed(std::int64_t value) {
  // Zigzag: 0, -1, 1, -2, …
  append_varint(fields_, static_cast<std::uint64_t>(value) << 1 ^ static_cast<std::uint64_t>(value >> 63));
}

void ThriftStruct::append_text(std::string_view value) {
  append_varint(fields_, value.size());
  fields_ += value;
}

}  // namespace runtime::parquet
