#include "drivers/haptic/space_mouse_setup.h"

#include <fcntl.h>
#include <grp.h>
#include <linux/hidraw.h>
#include <pwd.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <mutex>
#include <string_view>
#include <system_error>

#include "drivers/haptic/space_mouse_models.h"

namespace drivers::haptic {
namespace {

constexpr const char* kRulesFile = "udev/60-3dconnexion-spacemouse.rules";
constexpr const char* kGroup = "plugdev";

// HID usage tables: generic desktop, multi-axis controller.
constexpr unsigned short kGenericDesktop = 0x01;
constexpr unsigned short kMultiAxis = 0x08;

// hidapi keeps one text for the latest error that is no device's; each call that may set it is made alone.
std::mutex hidapi_mutex;
int hidapi_users = 0;

struct FreeEnumeration {
  void operator()(hid_device_info* first) const noexcept { hid_free_enumeration(first); }
};

/// Of ids and serial numbers, which are ASCII.
std::string narrow(const wchar_t* text) {
  std::string result;
  for (; text != nullptr && *text != L'\0'; ++text)
    result += *text > 0 && *text < 0x7f ? static_cast<char>(*text) : '?';
  return result;
}

/// hidapi lists a node once for each collection in its descriptor, and with zeros when it has none.
bool may_have_axes(const hid_device_info& listed) noexcept {
  return (listed.usage_page == kGenericDesktop && listed.usage == kMultiAxis) ||
         (listed.usage_page == 0 && listed.usage == 0);
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
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
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
  if (hidapi_users == 0 && hid_init() != 0) {
    throw SetupError({"hidapi", "initialise", "success", narrow(hid_error(nullptr)),
                      "install libhidapi-hidraw0 of Debian 12"});
  }
  ++hidapi_users;
}

HidapiUse::~HidapiUse() {
  const std::scoped_lock lock(hidapi_mutex);
  if (--hidapi_users == 0) hid_exit();
}

std::string describe(const SpaceMouseInfo& mouse) { return mouse.model + " (" + mouse.path + ")"; }

std::vector<SpaceMouseInfo> find_space_mice() {
  const HidapiUse hidapi;
  const std::scoped_lock lock(hidapi_mutex);
  std::vector<SpaceMouseInfo> found;
  for (const std::uint16_t vendor : {kVendor3Dconnexion, kVendorLogitech}) {
    const std::unique_ptr<hid_device_info, FreeEnumeration> first(hid_enumerate(vendor, 0));
    for (const hid_device_info* listed = first.get(); listed != nullptr; listed = listed->next) {
      const SpaceMouseModel* model = space_mouse_model(listed->vendor_id, listed->product_id);
      if (model == nullptr || listed->path == nullptr || !may_have_axes(*listed)) continue;
      found.push_back({.model = model->name,
                       .path = listed->path,
                       .serial = narrow(listed->serial_number),
                       .vendor = listed->vendor_id,
                       .product = listed->product_id});
    }
  }
  // hidraw2 before hidraw10.
  std::ranges::sort(found, [](const SpaceMouseInfo& a, const SpaceMouseInfo& b) {
    return a.path.size() != b.path.size() ? a.path.size() < b.path.size() : a.path < b.path;
  });
  const auto same_path = [](const SpaceMouseInfo& a, const SpaceMouseInfo& b) { return a.path == b.path; };
  found.erase(std::unique(found.begin(), found.end(), same_path), found.end());
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
  // one that is being unplugged does: only one that answers is left to it.
  if (const int error = try_node(mouse.path); error != 0)
    throw node_refused(mouse, node_facts(mouse.path, error));
  const std::scoped_lock lock(hidapi_mutex);
  HidDevice device(hid_open_path(mouse.path.c_str()));
  if (device == nullptr) {
    throw SetupError(
        {describe(mouse), "open", "success", narrow(hid_error(nullptr)), "plug the device in again"});
  }
  return device;
}

}  // namespace drivers::haptic
