/// @file
/// A record as column names and as a row of numbers, from one list.
///
/// A function next to the record is its schema,
///
///     template <typename Column>
///     void visit(const Record& record, Column&& column)
///
/// and calls `column(name, end, number, decimals)` for each column, in order. A name has two parts, because
/// joining them takes longer than writing the number.
#pragma once
#include <array>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/recording/recording_file.h"

namespace runtime {

inline constexpr std::size_t kMaxColumns = 128;

/// Setup. @throws std::length_error for more than kMaxColumns.
template <typename Record>
std::vector<RecordingFile::Column> columns_of(const Record& record) {
  std::vector<RecordingFile::Column> columns;
  visit(record, [&columns](const char* name, const char* end, double, int decimals) {
    columns.push_back({std::string(name) + end, decimals});
  });
  if (columns.size() > kMaxColumns) throw std::length_error("a record with more columns than a row has");
  return columns;
}

/// Appends the record to a file with columns_of() it.
template <typename Record>
void append_record(RecordingFile& file, const Record& record) noexcept {
  std::array<double, kMaxColumns> row;
  std::size_t width = 0;
  visit(record, [&](const char*, const char*, double value, int) { row[width++] = value; });
  file.append_row(std::span(row).first(width));
}

}  // namespace runtime
