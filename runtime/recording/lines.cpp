#include "runtime/recording/lines.h"

#include <algorithm>
#include <stdexcept>

namespace runtime {
namespace {

constexpr std::size_t kPiece_bytes = std::size_t{1} << 18;

}  // namespace

bool Lines::fill() {
  if (file_ == nullptr) return false;
  const std::size_t begun = left_.size();
  piece_.erase(0, piece_.size() - begun);  // keeps the beginning of a line
  // Grows for a line that is longer than a piece.
  piece_.resize(std::max(kPiece_bytes, 2 * begun));
  const std::size_t count = file_->read(piece_.data() + begun, piece_.size() - begun);
  piece_.resize(begun + count);
  left_ = piece_;
  read_bytes_ += count;
  if (read_bytes_ > limit_bytes_)
    throw std::runtime_error("has more than the " + std::to_string(limit_bytes_) +
                             " bytes that are expected");
  return count > 0;
}

bool Lines::next(std::string_view& line, bool& whole) {
  std::size_t end = left_.find('\n');
  while (end == left_.npos) {
    const std::size_t searched = left_.size();
    if (!fill()) break;
    end = left_.find('\n', searched);
  }
  if (left_.empty()) return false;
  whole = end != left_.npos;
  line = left_.substr(0, end);
  const std::size_t taken = whole ? end + 1 : left_.size();
  left_.remove_prefix(taken);
  left_bytes_ -= std::min(left_bytes_, taken);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return true;
}

}  // namespace runtime
