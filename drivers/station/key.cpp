#include "drivers/station/key.h"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <system_error>

#include "drivers/setup_error.h"
#include "drivers/station/sodium_ready.h"
#include "drivers/uninterrupted.h"

namespace drivers::station {
namespace {

constexpr const char* kReadStep = "read the key of the link";
constexpr const char* kMakeStep = "make a key for the link";

/// Closes the file with the scope.
class KeyFile {
 public:
  explicit KeyFile(int descriptor) : descriptor_(descriptor) {}
  KeyFile(const KeyFile&) = delete;
  KeyFile& operator=(const KeyFile&) = delete;
  ~KeyFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  int get() const noexcept { return descriptor_; }

 private:
  int descriptor_;
};

std::string system_message() { return std::generic_category().message(errno); }

}  // namespace

Key::~Key() { sodium_memzero(bytes_.data(), bytes_.size()); }

void make_key_file(const std::filesystem::path& path) {
  require_sodium();
  const KeyFile file(uninterrupted(
      [&path] { return ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600); }));
  if (file.get() < 0)
    throw SetupError({path.string(), kMakeStep, "a new file", system_message(),
                      "name a file that does not exist yet, in a folder of yours"});
  std::array<std::uint8_t, kKeyBytes> bytes{};
  randombytes_buf(bytes.data(), bytes.size());
  const ssize_t written = uninterrupted([&] { return ::write(file.get(), bytes.data(), bytes.size()); });
  const bool whole = written == static_cast<ssize_t>(bytes.size()) && ::fsync(file.get()) == 0;
  const std::string problem = whole ? std::string() : system_message();
  sodium_memzero(bytes.data(), bytes.size());
  if (whole) return;
  ::unlink(path.c_str());
  throw SetupError({path.string(), kMakeStep, "32 bytes written", problem, "free space, then repeat"});
}

Key read_key_file(const std::filesystem::path& path) {
  require_sodium();
  // Without O_NONBLOCK a pipe of that name would be waited for.
  const KeyFile file(uninterrupted(
      [&path] { return ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC); }));
  if (file.get() < 0)
    throw SetupError({path.string(), kReadStep, "a key file", system_message(),
                      "`youbotd --make-key FILE` makes one; copy it to the other station"});
  struct stat status {};
  if (::fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode))
    throw SetupError({path.string(), kReadStep, "a regular file", "something else", "name the key file"});
  if (status.st_uid != ::geteuid())
    throw SetupError({path.string(), kReadStep, "a file of user " + std::to_string(::geteuid()),
                      "one of user " + std::to_string(status.st_uid),
                      "`chown` it to the user that runs youbotd"});
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    throw SetupError({path.string(), kReadStep, "a file that no other user can read or write",
                      "one with rights for group or others",
                      "chmod 600 it; if others had access, make a new key"});
  // One byte more than a key shows a file that is too long.
  std::array<std::uint8_t, kKeyBytes + 1> bytes{};
  const ssize_t count = uninterrupted([&] { return ::read(file.get(), bytes.data(), bytes.size()); });
  if (count != static_cast<ssize_t>(kKeyBytes))
    throw SetupError({path.string(), kReadStep, "32 bytes",
                      count < 0 ? system_message()
                                : (count > static_cast<ssize_t>(kKeyBytes) ? "more" : std::to_string(count)),
                      "`youbotd --make-key FILE` makes one"});
  std::array<std::uint8_t, kKeyBytes> key{};
  std::copy_n(bytes.begin(), kKeyBytes, key.begin());
  sodium_memzero(bytes.data(), bytes.size());
  const Key read(key);
  sodium_memzero(key.data(), key.size());
  return read;
}

}  // namespace drivers::station
