#include "drivers/haptic/space_mouse_setup.h"

#include <fcntl.h>
#include <grp.h>
#include <linux/hidraw.h>
#include <pwd.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <mutex>
#include <system_error>

#include "drivers/haptic/hid_nodes.h"
#include "drivers/haptic/space_mouse_models.h"
#include "drivers/uninterrupted.h"

namespace drivers::haptic {
namespace {

constexpr const char* kRulesFile = "udev/60-3dconnexion-spacemouse.rules";
constexpr const char* kGroup = "plugdev";
/// A signal may interrupt an open(); so many in a row are no accident.
constexpr int kOpenTries = 100;

constexpr HidUsage kMultiAxisController{.page = 0x01, .usage = 0x08};  // HID usage tables: generic desktop

// hidapi keeps one text for the latest error that belongs to no device: calls that may set it take turns.
std::mutex hidapi_mutex;
int hidapi_users = 0;

/// A node that shows no report descriptor is judged by its ids alone.
bool may_have_axes(const HidNode& node) {
  const std::vector<std::uint8_t> descriptor = report_descriptor_of(node);
  return descriptor.empty() || has_collection(descriptor, kMultiAxisController);
}

std::string describe(const std::vector<SpaceMouseInfo>& found) {
  if (found.empty()) return "none";
  std::string all;
  for (const SpaceMouseInfo& mouse : found) {
    all += (all.empty() ? "" : ", ") + describe(mouse);
    all += mouse.serial.empty() ? " without serial number" : " with serial number " + mouse.serial;
  }
  return all;
}

std::string octal(unsigned mode) {
  std::string digits = "0";
  for (int shift = 6; shift >= 0; shift -= 3) digits += static_cast<char>('0' + (mode >> shift & 7U));
  return digits;
}

/// errno; 0: it is a HID node and answers.
int try_node(const std::string& path) noexcept {
  const int descriptor = uninterrupted([&] { return ::open(path.c_str(), O_RDWR | O_CLOEXEC); });
  if (descriptor < 0) return errno;
  int size = 0;
  const int error = ::ioctl(descriptor, HIDIOCGRDESCSIZE, &size) < 0 ? errno : 0;
  ::close(descriptor);
  return error;
}

HidNodeFacts node_facts(const std::string& path, int error) {
  HidNodeFacts facts{.error = error};
  struct stat node {};
  if (::stat(path.c_str(), &node) != 0) return facts;
  facts.mode = node.st_mode & 0777U;
  std::array<char, 4096> buffer{};
  passwd user{};
  passwd* user_found = nullptr;
  if (::getpwuid_r(node.st_uid, &user, buffer.data(), buffer.size(), &user_found) == 0 &&
      user_found != nullptr)
    facts.owner = user.pw_name;
  else
    facts.owner = std::to_string(node.st_uid);
  group its_group{};
  group* group_found = nullptr;
  if (::getgrgid_r(node.st_gid, &its_group, buffer.data(), buffer.size(), &group_found) == 0 &&
      group_found != nullptr)
    facts.group = its_group.gr_name;
  else
    facts.group = std::to_string(node.st_gid);
  return facts;
}

}  // namespace

HidapiUse::HidapiUse() {
  const std::scoped_lock lock(hidapi_mutex);
  if (hidapi_users == 0 && hid_init() != 0)
    throw SetupError(
        {"hidapi", "initialise", "success", "a refusal", "install libhidapi-hidraw0 of Debian 12"});
  ++hidapi_users;
}

HidapiUse::~HidapiUse() {
  const std::scoped_lock lock(hidapi_mutex);
  if (--hidapi_users == 0) hid_exit();
}

std::string describe(const SpaceMouseInfo& mouse) { return mouse.model + " (" + mouse.path + ")"; }

std::vector<SpaceMouseInfo> find_space_mice(const usb::SystemPaths& paths) {
  std::vector<SpaceMouseInfo> found;
  for (const HidNode& node : hid_nodes(paths)) {
    const SpaceMouseModel* model = space_mouse_model(node.vendor, node.product);
    if (model == nullptr || !may_have_axes(node)) continue;
    found.push_back({.model = model->name,
                     .path = node.path,
                     .serial = node.serial,
                     .vendor = node.vendor,
                     .product = node.product});
  }
  return found;
}

SpaceMouseInfo choose_space_mouse(const SpaceMouseChoice& choice, const std::vector<SpaceMouseInfo>& found) {
  for (const SpaceMouseInfo& mouse : found) {
    if (!choice.serial.empty() && choice.serial != mouse.serial) continue;
    if (!choice.path.empty() && choice.path != mouse.path) continue;
    return mouse;
  }
  std::string wanted = "one that is connected";
  if (!choice.serial.empty()) wanted += ", with serial number " + choice.serial;
  if (!choice.path.empty()) wanted += ", at " + choice.path;
  throw SetupError({"SpaceMouse", "find", wanted, describe(found),
                    found.empty()
                        ? "plug it in (a wireless one: its receiver or cable); the kernel has it when "
                          "there is a /dev/hidraw node more"
                        : "choose one of these, or none to take the first"});
}

SetupError node_refused(const SpaceMouseInfo& mouse, const HidNodeFacts& facts) {
  const std::string why = std::generic_category().message(facts.error);
  std::string found = why;
  std::string hint;
  switch (facts.error) {
    case EACCES: {
      if (facts.mode != 0)
        found += " (mode " + octal(facts.mode) + ", owner " + facts.owner + ", group " + facts.group + ")";
      const bool rule_applied = facts.group == kGroup && (facts.mode & 0060U) == 0060U;
      hint = rule_applied
                 ? std::string("add the user to the group ") + kGroup + " and log in again"
                 : std::string("copy ") + kRulesFile +
                       " to /etc/udev/rules.d, run \"udevadm control --reload\" and plug the device in "
                       "again: its node will belong to the group " +
                       kGroup;
      break;
    }
    case EPERM: hint = "inside a container: start it with access to this device"; break;
    case ENOENT:
    case ENXIO:
    case ENODEV:
    case EIO:
      hint = "plug the device in again; inside a container: start it with access to this device";
      break;
    default: hint = "plug the device in again, and see what the kernel says (dmesg)"; break;
  }
  return SetupError({describe(mouse), "open", "read and write access", found, hint});
}

HidDevice open_space_mouse(const SpaceMouseInfo& mouse) {
  // hidapi 0.13.1 frees the same memory twice when a node that it opened turns out to be no HID device, as
  // one that is being unplugged does: only one that answers is left to it. That leaves the microseconds
  // between hidapi's own open() and its question.
  if (const int error = try_node(mouse.path); error != 0)
    throw node_refused(mouse, node_facts(mouse.path, error));
  const std::scoped_lock lock(hidapi_mutex);
  HidDevice device;
  for (int tries = 0; tries < kOpenTries && device == nullptr; ++tries) {
    errno = 0;
    device.reset(hid_open_path(mouse.path.c_str()));
    if (errno != EINTR) break;
  }
  // hidapi 0.13.1 calls nothing that fails after the open() or ioctl() that did.
  if (device == nullptr) throw node_refused(mouse, node_facts(mouse.path, errno));
  return device;
}

}  // namespace drivers::haptic
