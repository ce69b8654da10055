/// @file
/// The lines of a text in memory, or of a file that is read piece by piece.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

#include "runtime/configuration/regular_file.h"

namespace runtime {

class Lines {
 public:
  explicit Lines(std::string_view text) noexcept : left_(text), left_bytes_(text.size()) {}
  /// `limit_bytes`: for the whole file, which may grow while it is read.
  Lines(const RegularFile& file, std::size_t limit_bytes)
      : file_(&file), limit_bytes_(limit_bytes), left_bytes_(file.size_bytes()) {}

  /// The next line without its line end; valid until the next call. `whole`: it has a line end. False after
  /// the last one.
  /// @throws std::runtime_error as RegularFile::read() does, and if the file is longer than allowed.
  bool next(std::string_view& line, bool& whole);
  /// Approximate number of bytes after the lines so far.
  std::size_t left_bytes() const noexcept { return left_bytes_; }

 private:
  bool fill();

  const RegularFile* file_ = nullptr;
  std::size_t limit_bytes_ = 0;
  std::size_t read_bytes_ = 0;
  std::string piece_;
  std::string_view left_;  // of the text, or of the piece
  std::size_t left_bytes_;
};

}  // namespace runtime
