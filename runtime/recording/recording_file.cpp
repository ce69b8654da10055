#include "runtime/recording/recording_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "drivers/uninterrupted.h"
#include "hal/setup_error.h"
#include "runtime/recording/file_size_signal.h"

namespace runtime {
namespace {

constexpr std::string_view kFirstLine = "# youbot recording v1\n";
/// Two to three flush intervals of a 1 kHz recording with a dozen columns.
constexpr std::size_t kBufferBytes = 64 * 1024;
/// Shortest text of a double: sign, 17 digits, point, "e-308".
constexpr std::size_t kLongestShortestChars = 24;
/// Fixed notation writes all digits of the largest double: sign, 309 digits, point, then the decimals.
constexpr std::size_t kLongestFixedChars = 2 + std::numeric_limits<double>::max_exponent10 + 1;

struct WriteResult {
  std::size_t bytes = 0;  ///< that reached the file, also if the rest failed
  int error_number = 0;
};

WriteResult write_all(int fd, std::span<const char> text) noexcept {
  const FileSizeSignalHeldBack held_back;
  WriteResult result;
  while (result.bytes < text.size()) {
    const auto rest = text.subspan(result.bytes);
    const ssize_t count = drivers::uninterrupted([&] { return ::write(fd, rest.data(), rest.size()); });
    if (count <= 0) {
      // No file system should return 0; a retry might never end.
      result.error_number = count < 0 ? errno : ENOSPC;
      break;
    }
    result.bytes += static_cast<std::size_t>(count);
  }
  return result;
}

bool truncate_to(int fd, std::int64_t bytes) noexcept {
  return drivers::uninterrupted([&] { return ::ftruncate(fd, bytes); }) == 0;
}

std::size_t longest_value_chars(const std::optional<int>& decimals) {
  return decimals ? kLongestFixedChars + static_cast<std::size_t>(*decimals) : kLongestShortestChars;
}

/// Same result as std::to_chars() with fixed decimals, in a fifth of the time: the value is scaled to an
/// integer where the error of the scaling cannot change the rounding. Null where it could.
char* format_scaled(char* out, char* end, double value, int decimals) noexcept {
  constexpr std::array<double, 10> kPowers{1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
  constexpr std::array<std::uint64_t, 10> kWholePowers{
      1, 10, 100, 1'000, 10'000, 100'000, 1'000'000, 10'000'000, 100'000'000, 1'000'000'000};
  constexpr double kLargest = 1e12;     // doubles are 1e-4 apart there
  constexpr double kCertainly = 0.499;  // from the nearest integer
  if (decimals >= static_cast<int>(kPowers.size())) return nullptr;
  const double scaled = std::abs(value) * kPowers[static_cast<std::size_t>(decimals)];
  if (!(scaled < kLargest)) return nullptr;
  const double half_above = scaled + 0.5;  // values that round incorrectly are left to std::to_chars below
  const auto digits = static_cast<std::uint64_t>(half_above);
  if (std::abs(scaled - static_cast<double>(digits)) > kCertainly) return nullptr;
  const std::uint64_t power = kWholePowers[static_cast<std::size_t>(decimals)];
  auto whole = static_cast<std::uint64_t>(std::abs(value));
  std::uint64_t part = digits - whole * power;
  if (part == power) {  // rounded up
    ++whole;
    part = 0;
  }
  if (std::signbit(value)) *out++ = '-';
  out = std::to_chars(out, end, whole).ptr;
  if (decimals == 0) return out;
  // A leading one keeps the zeros of the decimals; the point then replaces it.
  char* const point = out;
  out = std::to_chars(out, end, power + part).ptr;
  *point = '.';
  return out;
}

/// The caller has reserved longest_value_chars().
char* format_value(char* out, char* end, double value, const std::optional<int>& decimals) noexcept {
  // One spelling; to_chars would distinguish -nan from nan.
  if (std::isnan(value)) return std::ranges::copy(std::string_view("nan"), out).out;
  if (!decimals) return std::to_chars(out, end, value).ptr;
  if (char* const behind = format_scaled(out, end, value, *decimals)) return behind;
  return std::to_chars(out, end, value, std::chars_format::fixed, *decimals).ptr;
}

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

void require(bool condition, const std::filesystem::path& path, const std::string& problem) {
  if (!condition) throw std::invalid_argument("recording " + path.string() + ": " + problem);
}

std::string make_header(const std::filesystem::path& path,
                        const std::vector<RecordingFile::Comment>& comments,
                        const std::vector<RecordingFile::Column>& columns) {
  std::string header(kFirstLine);
  for (const auto& [key, value] : comments) {
    require(!key.empty() && key.find(':') == std::string::npos && std::ranges::none_of(key, is_control), path,
            "comment key \"" + key + "\": expected one line without a colon");
    require(std::ranges::none_of(value, is_control), path,
            "comment \"" + key + "\": expected a value of one line, without control characters");
    header += "# " + key + ": " + value + '\n';
  }

  require(!columns.empty(), path, "expected at least one column");
  for (auto column = columns.begin(); column != columns.end(); ++column) {
    const auto& [name, decimals] = *column;
    require(!name.empty() && name.find_first_of(",#\" ") == std::string::npos &&
                std::ranges::none_of(name, is_control),
            path, "column \"" + name + "\": expected a name without comma, space, quote or #");
    require(std::ranges::count(columns.begin(), column, name, &RecordingFile::Column::name) == 0, path,
            "column \"" + name + "\" is given twice");
    require(!decimals || (*decimals >= 0 && *decimals <= RecordingFile::kMaxDecimals), path,
            "column \"" + name + "\": expected 0 to " + std::to_string(RecordingFile::kMaxDecimals) +
                " decimals");
    if (column != columns.begin()) header += ',';
    header += name;
  }
  return header + '\n';
}

}  // namespace

RecordingFile::RecordingFile(const std::filesystem::path& path, const std::vector<Comment>& comments,
                             const std::vector<Column>& columns, Existing existing)
    : path_(path.string()) {
  const std::string header = make_header(path, comments, columns);
  for (const Column& column : columns) {
    decimals_.push_back(column.decimals);
    longest_row_bytes_ += longest_value_chars(column.decimals) + 1;  // comma or line end
  }
  buffer_.resize(std::max(kBufferBytes, longest_row_bytes_));
  create(header, existing);
}

/// Last in the constructor, so that no other exception can leak the descriptor.
void RecordingFile::create(const std::string& header, Existing existing) {
  bool is_ours = false;  // created or emptied here: without a complete header it is not a recording
  const auto refuse = [this, &is_ours](const char* problem, int error_number, const char* hint) {
    if (fd_ >= 0) ::close(fd_);
    if (is_ours) ::unlink(path_.c_str());
    std::string step = problem;
    if (error_number != 0) step += ": " + std::generic_category().message(error_number);
    throw hal::SetupError("recording " + path_, step, hint);
  };
  // O_APPEND: after a torn row is cut off, the next write goes to the new end and leaves no hole. No O_TRUNC:
  // the file may be another daemon's; only the lock shows that.
  const auto open = [this](int more) {
    return drivers::uninterrupted(
        [&] { return ::open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | more, 0644); });
  };
  fd_ = open(O_EXCL | O_NOFOLLOW);
  is_ours = fd_ >= 0;
  struct stat status {};
  const auto refuse_special = [&] {
    if (!S_ISREG(status.st_mode))
      refuse("not a regular file", 0, "a torn row could not be cut off it; choose another path");
  };
  if (fd_ < 0 && errno == EEXIST) {
    // Before it is opened: a device may react to that.
    if (::stat(path_.c_str(), &status) == 0) refuse_special();
    if (existing == Existing::kRefuse)
      refuse("cannot create the file", EEXIST, "it is not replaced; choose another path");
    fd_ = open(O_NONBLOCK);  // a pipe in its place has no reader
  }
  if (fd_ < 0) refuse("cannot create the file", errno, "the folder must exist and be writable");

  if (::fstat(fd_, &status) != 0) refuse("cannot inspect the file", errno, "choose another folder");
  refuse_special();
  // File systems without locks (some network ones) still record; only a lock held elsewhere prevents it.
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    refuse("another recording is being written to the file", 0, "stop that one or choose another path");
  }
  if (!truncate_to(fd_, 0)) refuse("cannot empty the file", errno, "choose another path");
  is_ours = true;
  if (const auto written = write_all(fd_, header); written.error_number != 0)
    refuse("cannot write the header", written.error_number, "make room or choose another folder");
  file_bytes_ = static_cast<std::int64_t>(header.size());
}

void RecordingFile::append_row(std::span<const double> values) noexcept {
  if (fd_ < 0) return lose_row(Step::kAppendClosed);
  if (values.size() != decimals_.size()) return lose_row(Step::kAppendWidth);
  if (buffer_.size() - buffered_bytes_ < longest_row_bytes_) flush();

  char* out = buffer_.data() + buffered_bytes_;
  char* const end = buffer_.data() + buffer_.size();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0) *out++ = ',';
    out = format_value(out, end, values[i], decimals_[i]);
  }
  *out++ = '\n';
  buffered_bytes_ = static_cast<std::size_t>(out - buffer_.data());
  ++buffered_rows_;
}

void RecordingFile::flush() noexcept {
  if (buffered_rows_ == 0) return;
  std::uint64_t rows_kept = 0;
  if (restore_last_whole_row()) {
    const std::span<const char> rows(buffer_.data(), buffered_bytes_);
    const auto [bytes, error_number] = write_all(fd_, rows);
    const auto reached = rows.first(bytes);
    const auto after_last_row = std::find(reached.rbegin(), reached.rend(), '\n').base();
    rows_kept = error_number == 0
                    ? buffered_rows_
                    : static_cast<std::uint64_t>(std::count(reached.begin(), after_last_row, '\n'));
    file_bytes_ += after_last_row - reached.begin();
    if (error_number != 0) {
      note(Step::kWrite, error_number);
      if (after_last_row != reached.end() && !truncate_to(fd_, file_bytes_)) {
        note(Step::kCutTornRow, errno);  // the next flush or close() tries again
      }
    }
  }
  rows_written_.fetch_add(rows_kept, std::memory_order_relaxed);
  rows_lost_.fetch_add(buffered_rows_ - rows_kept, std::memory_order_relaxed);
  buffered_bytes_ = 0;
  buffered_rows_ = 0;
}

void RecordingFile::close() noexcept {
  if (fd_ < 0) return;
  flush();
  restore_last_whole_row();
  // A disk that failed behind the page cache reports it here, and only once.
  if (drivers::uninterrupted([this] { return ::fsync(fd_); }) != 0) {
    close_failure_.store({Step::kSync, errno}, std::memory_order_relaxed);
  }
  // Not repeated after EINTR: Linux has already closed the descriptor, and nothing is lost.
  if (::close(fd_) != 0 && errno != EINTR &&
      close_failure_.load(std::memory_order_relaxed).step == Step::kNone) {
    close_failure_.store({Step::kClose, errno}, std::memory_order_relaxed);
  }
  fd_ = -1;
}

/// Leaves exactly the header and complete rows in the file, and checks that the file still exists: an
/// unlinked file accepts writes without an error.
bool RecordingFile::restore_last_whole_row() noexcept {
  struct stat status {};
  if (::fstat(fd_, &status) != 0) {
    note(Step::kInspect, errno);
    return false;
  }
  if (status.st_nlink == 0 || status.st_size < file_bytes_) {
    note(status.st_nlink == 0 ? Step::kFoundDeleted : Step::kFoundShortened, 0);
    rows_lost_.fetch_add(rows_written_.exchange(0, std::memory_order_relaxed), std::memory_order_relaxed);
    return false;
  }
  if (status.st_size > file_bytes_ && !truncate_to(fd_, file_bytes_)) {
    note(Step::kCutTornRow, errno);
    return false;
  }
  return true;
}

void RecordingFile::lose_row(Step step) noexcept {
  note(step, 0);
  rows_lost_.fetch_add(1, std::memory_order_relaxed);
}

void RecordingFile::note(Step step, int error_number) noexcept {
  if (first_failure_.load(std::memory_order_relaxed).step == Step::kNone) {
    first_failure_.store({step, error_number}, std::memory_order_relaxed);
  }
}

std::string RecordingFile::error() const {
  const Failure first = first_failure_.load(std::memory_order_relaxed);
  const Failure at_close = close_failure_.load(std::memory_order_relaxed);
  if (first.step == Step::kNone && at_close.step == Step::kNone) return "";

  std::string words = "recording " + path_ + ": ";
  if (first.step != Step::kNone) words += in_words(first) + "; ";
  if (at_close.step != Step::kNone) words += in_words(at_close) + "; ";
  return words + std::to_string(rows_lost()) + " rows lost, " + std::to_string(rows_written()) + " written";
}

std::string RecordingFile::in_words(Failure failure) {
  auto step = [&]() -> std::string {
    switch (failure.step) {
      case Step::kNone: return "no failure";
      case Step::kAppendWidth: return "a row did not have one value for each column";
      case Step::kAppendClosed: return "a row came after the file was closed";
      case Step::kInspect: return "cannot inspect the file";
      case Step::kFoundDeleted: return "the file was deleted while it was being written";
      case Step::kFoundShortened: return "another program cut the file short";
      case Step::kWrite: return "cannot write rows";
      case Step::kCutTornRow: return "cannot cut off a torn row, so the last line may be torn";
      case Step::kSync: return "the disk did not confirm the last rows (fsync)";
      case Step::kClose: return "cannot close the file";
    }
    return "unknown failure";
  }();
  if (failure.error_number == 0) return step;
  return step + ": " + std::generic_category().message(failure.error_number);
}

}  // namespace runtime
