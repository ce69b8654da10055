#include "runtime/configuration/regular_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <stdexcept>
#include <system_error>

#include "drivers/uninterrupted.h"

namespace runtime {
namespace {

/// What Windows programs call Unicode text.
bool begins_like_utf16(int fd) {
  std::array<unsigned char, 2> mark{};
  const ssize_t count = drivers::uninterrupted([&] { return ::pread(fd, mark.data(), mark.size(), 0); });
  return count == 2 && ((mark[0] == 0xff && mark[1] == 0xfe) || (mark[0] == 0xfe && mark[1] == 0xff));
}

}  // namespace

// O_NONBLOCK: does not wait for a pipe without a writer.
RegularFile::RegularFile(const std::filesystem::path& path, Content content)
    : fd_(drivers::uninterrupted(
          [&path] { return ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY); })) {
  if (fd_ < 0) throw std::runtime_error("cannot be opened: " + std::generic_category().message(errno));
  std::string refused;
  if (::fstat(fd_, &status_) != 0) refused = "cannot be examined: " + std::generic_category().message(errno);
  if (refused.empty() && S_ISDIR(status_.st_mode)) refused = "is a directory, expected a file";
  if (refused.empty() && !S_ISREG(status_.st_mode)) refused = "is a device or pipe, expected a file";
  if (refused.empty() && content == Content::kText && begins_like_utf16(fd_))
    refused = "is UTF-16 text: save it as UTF-8";
  if (!refused.empty()) {
    ::close(fd_);
    throw std::runtime_error(refused);
  }
}

RegularFile::~RegularFile() { ::close(fd_); }

std::size_t RegularFile::read(char* buffer, std::size_t size) const {
  const ssize_t count = drivers::uninterrupted([&] { return ::read(fd_, buffer, size); });
  if (count < 0) throw std::runtime_error("cannot be read: " + std::generic_category().message(errno));
  return static_cast<std::size_t>(count);
}

std::string read_whole(const RegularFile& file, std::size_t limit_bytes) {
  // Does not rely on the size: files of the kernel report 0, and others may grow.
  std::string text;
  for (std::size_t used = 0;;) {
    text.resize(std::min(used + 65536, limit_bytes + 1));
    const std::size_t count = file.read(text.data() + used, text.size() - used);
    used += count;
    if (used > limit_bytes)
      throw std::runtime_error("has more than the " + std::to_string(limit_bytes) +
                               " bytes that are expected");
    if (count == 0) {
      text.resize(used);
      return text;
    }
  }
}

std::string read_regular_file(const std::filesystem::path& path, std::size_t limit_bytes, Content content) {
  return read_whole(RegularFile(path, content), limit_bytes);
}

}  // namespace runtime
