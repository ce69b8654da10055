/// @file
/// Writes tables of numbers and texts as Apache Parquet, format version 2
/// (https://parquet.apache.org/docs/file-format/, https://github.com/apache/parquet-format).
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "runtime/parquet/thrift_struct.h"

namespace runtime::parquet {

/// In the order of the alternatives of Values.
enum class Type : std::uint8_t { kInt64, kFloat, kDouble, kText };
using Values = std::variant<std::vector<std::int64_t>, std::vector<float>, std::vector<double>,
                            std::vector<std::string>>;

struct Column {
  std::string name;
  Type type = Type::kInt64;
  /// Each row has a list of so many elements; nothing: one value.
  std::optional<std::size_t> list_length = std::nullopt;
};

/// The subset that our tables need: every value is there, and all lists of a column have one length. Columns
/// and elements are nevertheless optional in the schema, as other writers of such tables declare them,
/// because readers compare schemas. A row group has one page for each column: plain encoding, compressed by
/// zstd.
///
///     ParquetWriter writer([&](std::string_view bytes) { file.write(bytes); }, "youbot-hal",
///                          {{"index", Type::kInt64}, {"action", Type::kFloat, 8}});
///     writer.add_row_group(2, {std::vector<std::int64_t>{0, 1}, std::vector<float>(16)});
///     writer.finish();
class ParquetWriter {
 public:
  struct KeyValue {
    std::string key;
    std::string value;
  };

  /// `write` gets the file piece by piece; whatever it throws passes through.
  ParquetWriter(std::function<void(std::string_view)> write, std::string created_by,
                std::vector<Column> columns, std::vector<KeyValue> metadata = {});

  /// The values of each column, row by row. @throws std::invalid_argument for another type or number of
  /// values than the columns have; std::length_error for a column of more than 2 GB.
  void add_row_group(std::size_t rows, std::span<const Values> values);
  /// Ends the file. Nothing may follow.
  void finish();

  std::uint64_t bytes_written() const noexcept { return position_; }

 private:
  void write(std::string_view bytes);
  ThriftStruct write_column(const Column& column, std::size_t rows, const Values& values,
                            std::int64_t& uncompressed_bytes);
  std::vector<ThriftStruct> schema() const;

  std::function<void(std::string_view)> write_;
  std::string created_by_;
  std::vector<Column> columns_;
  std::vector<KeyValue> metadata_;
  std::uint64_t position_ = 0;
  std::int64_t rows_ = 0;
  std::vector<ThriftStruct> row_groups_;
};

}  // namespace runtime::parquet
