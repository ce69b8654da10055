#include "tests/guest_kernel/device_node.h"

#include <fcntl.h>
#include <grp.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <ostream>
#include <system_error>

#include "tests/guest_kernel/wait_until.h"

namespace guest {
namespace {

namespace fs = std::filesystem;

constexpr uid_t kNobody = 65534;

unsigned read_number(const fs::path& file, std::ios::fmtflags base) {
  std::ifstream stream(file);
  stream.setf(base, std::ios::basefield);
  unsigned number = 0;
  stream >> number;
  return number;
}

/// udev stores its data of a device under the device's number after the rules have run.
bool udev_is_done_with(const struct stat& node) {
  return fs::exists("/run/udev/data/c" + std::to_string(major(node.st_rdev)) + ":" +
                    std::to_string(minor(node.st_rdev)));
}

}  // namespace

void PrintTo(const NodeAccess& access, std::ostream* stream) {
  *stream << std::oct << access.mode << std::dec << " for group " << access.group;
}

std::optional<NodeAccess> access_by_udev(const fs::path& node) {
  struct stat found {};
  const auto done = [&] { return ::stat(node.c_str(), &found) == 0 && udev_is_done_with(found); };
  if (!wait_until(done) || ::stat(node.c_str(), &found) != 0) return std::nullopt;
  const group* const owner = ::getgrgid(found.st_gid);
  return NodeAccess{found.st_mode & 07777U, owner != nullptr ? owner->gr_name : "unknown"};
}

void settle_udev() { (void)!std::system("udevadm settle --timeout=20"); }

bool opens_for_a_user(const fs::path& node, const char* group_name) {
  const group* const membership = ::getgrnam(group_name);
  if (membership == nullptr) return false;
  const gid_t gid = membership->gr_gid;
  const pid_t child = ::fork();
  if (child == 0) {
    const bool dropped = ::setgroups(0, nullptr) == 0 && ::setgid(gid) == 0 && ::setuid(kNobody) == 0;
    ::_exit(dropped && ::open(node.c_str(), O_RDWR | O_CLOEXEC) >= 0 ? 0 : 1);
  }
  int status = -1;
  return child > 0 && ::waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

std::optional<fs::path> find_usb_node(unsigned vendor, unsigned product) {
  std::error_code error;
  for (const auto& device : fs::directory_iterator("/sys/bus/usb/devices", error)) {
    const fs::path& folder = device.path();
    if (read_number(folder / "idVendor", std::ios::hex) != vendor ||
        read_number(folder / "idProduct", std::ios::hex) != product)
      continue;
    char name[32];
    (void)std::snprintf(name, sizeof name, "%03u/%03u", read_number(folder / "busnum", std::ios::dec),
                        read_number(folder / "devnum", std::ios::dec));
    return fs::path("/dev/bus/usb") / name;
  }
  return std::nullopt;
}

std::optional<fs::path> find_hidraw_node(unsigned vendor, unsigned product) {
  char ids[16];  // of the HID device "0003:256F:C635.0001"
  (void)std::snprintf(ids, sizeof ids, ":%04X:%04X.", vendor, product);
  std::error_code error;
  for (const auto& raw : fs::directory_iterator("/sys/class/hidraw", error)) {
    const std::string device = fs::read_symlink(raw.path() / "device", error).filename();
    if (device.find(ids) != std::string::npos) return "/dev" / raw.path().filename();
  }
  return std::nullopt;
}

}  // namespace guest
