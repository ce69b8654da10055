#include "runtime/parquet/parquet_writer.h"

#include <array>
#include <bit>
#include <limits>
#include <stdexcept>
#include <utility>

#include "runtime/mcap/bytes.h"
#include "runtime/mcap/compression.h"

namespace runtime::parquet {
namespace {

// From parquet.thrift. Field numbers in this file are those of the structures there.
constexpr std::array<std::int32_t, 4> kPhysicalTypes{2, 4, 5, 6};  // INT64, FLOAT, DOUBLE, BYTE_ARRAY
constexpr std::int32_t kOptional = 1;
constexpr std::int32_t kRepeated = 2;
constexpr std::int32_t kConvertedText = 0;
constexpr std::int32_t kConvertedList = 3;
constexpr std::int32_t kPlain = 0;
constexpr std::int32_t kRle = 3;
constexpr std::int32_t kZstd = 6;
constexpr std::int32_t kDataPage = 0;

constexpr std::string_view kMagic = "PAR1";
constexpr const char* kList = "list";  // the names that the specification gives the groups of a list
constexpr const char* kElement = "element";

/// Levels with their length in front, as in a data page of the first version.
void append_levels(std::string& page, std::string_view levels) {
  runtime::mcap::append_number(page, static_cast<std::uint32_t>(levels.size()));
  page += levels;
}

/// `count` times the same level, as one run.
std::string run_of(std::size_t count, int level) {
  std::string run;
  append_varint(run, std::uint64_t{count} << 1);
  return run + static_cast<char>(level);
}

/// Zero where a list begins and one for its other elements, one bit each.
std::string list_starts(std::size_t count, std::size_t list_length) {
  const std::size_t bytes = (count + 7) / 8;
  std::string bits;
  append_varint(bits, std::uint64_t{bytes} << 1 | 1);
  const std::size_t head = bits.size();
  bits.resize(head + bytes);
  for (std::size_t i = 0; i < count; ++i)
    if (i % list_length != 0) bits[head + i / 8] = static_cast<char>(bits[head + i / 8] | 1 << i % 8);
  return bits;
}

void append_value(std::string& page, std::int64_t value) {
  runtime::mcap::append_number(page, static_cast<std::uint64_t>(value));
}
void append_value(std::string& page, float value) {
  runtime::mcap::append_number(page, std::bit_cast<std::uint32_t>(value));
}
void append_value(std::string& page, double value) {
  runtime::mcap::append_number(page, std::bit_cast<std::uint64_t>(value));
}
void append_value(std::string& page, const std::string& value) { runtime::mcap::append_string(page, value); }

std::size_t size_of(const Values& values) {
  return std::visit([](const auto& each) { return each.size(); }, values);
}

std::int32_t page_size(std::size_t bytes, const Column& column) {
  if (bytes > std::numeric_limits<std::int32_t>::max())
    throw std::length_error("Parquet: more than 2 GB in a row group of the column " + column.name);
  return static_cast<std::int32_t>(bytes);
}

}  // namespace

ParquetWriter::ParquetWriter(std::function<void(std::string_view)> write, std::string created_by,
                             std::vector<Column> columns, std::vector<KeyValue> metadata)
    : write_(std::move(write)),
      created_by_(std::move(created_by)),
      columns_(std::move(columns)),
      metadata_(std::move(metadata)) {
  this->write(kMagic);
}

void ParquetWriter::write(std::string_view bytes) {
  write_(bytes);
  position_ += bytes.size();
}

void ParquetWriter::add_row_group(std::size_t rows, std::span<const Values> values) {
  if (values.size() != columns_.size()) throw std::invalid_argument("Parquet: a row group of other columns");
  for (std::size_t i = 0; i < columns_.size(); ++i)
    if (values[i].index() != static_cast<std::size_t>(columns_[i].type) ||
        size_of(values[i]) != rows * columns_[i].list_length.value_or(1))
      throw std::invalid_argument("Parquet: other values than the column " + columns_[i].name + " has");
  const std::uint64_t begin = position_;
  std::vector<ThriftStruct> chunks;
  std::int64_t uncompressed_bytes = 0;
  for (std::size_t i = 0; i < columns_.size(); ++i)
    chunks.push_back(write_column(columns_[i], rows, values[i], uncompressed_bytes));
  row_groups_.push_back(ThriftStruct()
                            .structure_list(1, chunks)
                            .i64(2, uncompressed_bytes)
                            .i64(3, static_cast<std::int64_t>(rows))
                            .i64(5, static_cast<std::int64_t>(begin))
                            .i64(6, static_cast<std::int64_t>(position_ - begin)));
  rows_ += static_cast<std::int64_t>(rows);
}

ThriftStruct ParquetWriter::write_column(const Column& column, std::size_t rows, const Values& values,
                                         std::int64_t& uncompressed_bytes) {
  const std::size_t count = rows * column.list_length.value_or(1);
  std::string page;
  if (column.list_length) append_levels(page, list_starts(count, *column.list_length));
  // The highest level: nothing is missing.
  append_levels(page, run_of(count, column.list_length ? 3 : 1));
  std::visit(
      [&page](const auto& each) {
        for (const auto& value : each) append_value(page, value);
      },
      values);

  const std::string compressed = mcap::compress(mcap::Compression::kZstd, page);
  const std::string header =
      ThriftStruct()
          .i32(1, kDataPage)
          .i32(2, page_size(page.size(), column))
          .i32(3, page_size(compressed.size(), column))
          .structure(5,
                     ThriftStruct().i32(1, page_size(count, column)).i32(2, kPlain).i32(3, kRle).i32(4, kRle))
          .bytes();
  const std::uint64_t begin = position_;
  write(header);
  write(compressed);

  const auto total = static_cast<std::int64_t>(header.size() + page.size());
  uncompressed_bytes += total;
  std::vector<std::string> path{column.name};
  if (column.list_length) path.insert(path.end(), {kList, kElement});
  return ThriftStruct()
      .i64(2, 0)  // deprecated
      .structure(3, ThriftStruct()
                        .i32(1, kPhysicalTypes[static_cast<std::size_t>(column.type)])
                        .i32_list(2, std::array{kPlain, kRle})
                        .text_list(3, path)
                        .i32(4, kZstd)
                        .i64(5, static_cast<std::int64_t>(count))
                        .i64(6, total)
                        .i64(7, static_cast<std::int64_t>(position_ - begin))
                        .i64(9, static_cast<std::int64_t>(begin)));
}

std::vector<ThriftStruct> ParquetWriter::schema() const {
  const ThriftStruct empty;
  std::vector<ThriftStruct> elements{
      ThriftStruct().text(4, "schema").i32(5, static_cast<std::int32_t>(columns_.size()))};
  for (const Column& column : columns_) {
    if (column.list_length) {
      elements.push_back(ThriftStruct()
                             .i32(3, kOptional)
                             .text(4, column.name)
                             .i32(5, 1)
                             .i32(6, kConvertedList)
                             .structure(10, ThriftStruct().structure(3, empty)));
      elements.push_back(ThriftStruct().i32(3, kRepeated).text(4, kList).i32(5, 1));
    }
    ThriftStruct value;
    value.i32(1, kPhysicalTypes[static_cast<std::size_t>(column.type)])
        .i32(3, kOptional)
        .text(4, column.list_length ? kElement : column.name);
    if (column.type == Type::kText)
      value.i32(6, kConvertedText).structure(10, ThriftStruct().structure(1, empty));
    elements.push_back(value);
  }
  return elements;
}

void ParquetWriter::finish() {
  ThriftStruct footer;
  footer.i32(1, 2).structure_list(2, schema()).i64(3, rows_).structure_list(4, row_groups_);
  if (!metadata_.empty()) {
    std::vector<ThriftStruct> pairs;
    for (const auto& [key, value] : metadata_) pairs.push_back(ThriftStruct().text(1, key).text(2, value));
    footer.structure_list(5, pairs);
  }
  std::string end = footer.text(6, created_by_).bytes();
  mcap::append_number(end, static_cast<std::uint32_t>(end.size()));
  write(end += kMagic);
}

}  // namespace runtime::parquet
