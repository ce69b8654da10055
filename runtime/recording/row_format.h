/// @file
/// How rows of numbers become the bytes of a file.
#pragma once
#include <cstdint>
#include <span>
#include <string>

#include "runtime/recording/append_file.h"

namespace runtime {

/// Holds rows in memory until they are written. One thread at a time.
class RowFormat {
 public:
  RowFormat() = default;
  RowFormat(const RowFormat&) = delete;
  RowFormat& operator=(const RowFormat&) = delete;
  virtual ~RowFormat() = default;

  /// Setup: what precedes the rows in the file.
  virtual const std::string& head() const noexcept = 0;

  /// Into memory; not if it is full(). False if the format cannot hold the row.
  virtual bool append_row(std::span<const double> values) noexcept = 0;
  virtual bool full() const noexcept = 0;
  virtual std::uint64_t rows_in_memory() const noexcept = 0;

  /// Rows in memory that are in the file now. None is in memory afterwards.
  virtual std::uint64_t write_to(AppendFile& file) noexcept = 0;
  virtual void discard_rows() noexcept = 0;
  /// After the last row, before the file is closed.
  virtual void finish(AppendFile& /*file*/) noexcept {}
};

}  // namespace runtime
