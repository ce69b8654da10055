#include "drivers/usb/usb_access.h"

#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <system_error>

namespace drivers::usb {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kGroupMayUse = S_IRGRP | S_IWGRP;

std::string node_of(const UsbDevice& device, const SystemPaths& paths) {
  std::array<char, 16> place{};
  (void)std::snprintf(place.data(), place.size(), "%03u/%03u", static_cast<unsigned>(device.bus),
                      static_cast<unsigned>(device.address));
  return (paths.dev / "bus/usb" / place.data()).string();
}

std::string user_name(uid_t user) {
  const passwd* const entry = getpwuid(user);
  return entry != nullptr ? entry->pw_name : std::to_string(user);
}

std::string group_name(gid_t group) {
  const struct group* const entry = getgrgid(group);
  return entry != nullptr ? entry->gr_name : std::to_string(group);
}

bool process_in_group(gid_t group) {
  if (getegid() == group) return true;
  std::vector<gid_t> groups(static_cast<std::size_t>(std::max(getgroups(0, nullptr), 0)));
  const int count = getgroups(static_cast<int>(groups.size()), groups.data());
  return count > 0 && std::find(groups.begin(), groups.begin() + count, group) != groups.begin() + count;
}

bool user_listed_in_group(uid_t user, gid_t group) {
  const passwd* const entry = getpwuid(user);
  if (entry == nullptr) return false;
  std::array<gid_t, 256> groups{};
  int count = static_cast<int>(groups.size());
  if (getgrouplist(entry->pw_name, entry->pw_gid, groups.data(), &count) < 0) return false;
  return std::find(groups.begin(), groups.begin() + count, group) != groups.begin() + count;
}

void collect_node(AccessFacts& facts, const SystemPaths& paths) {
  facts.node = node_of(facts.device, paths);
  std::error_code ignored;
  facts.node_folder_there = fs::is_directory(paths.dev / "bus/usb", ignored);
  facts.user = user_name(getuid());
  struct stat status {};
  if (::stat(facts.node.c_str(), &status) != 0) return;
  facts.node_there = true;
  facts.may_use_node = ::access(facts.node.c_str(), R_OK | W_OK) == 0;
  facts.node_mode = status.st_mode & 07777U;
  facts.node_owner = user_name(status.st_uid);
  facts.node_group = group_name(status.st_gid);
  facts.in_group = process_in_group(status.st_gid);
  facts.listed_in_group = user_listed_in_group(getuid(), status.st_gid);
}

std::string find_rules(const std::string& name, const SystemPaths& paths) {
  if (name.empty()) return {};
  std::error_code ignored;
  for (const fs::path& directory : paths.rule_directories) {
    if (fs::exists(directory / name, ignored)) return (directory / name).string();
  }
  return {};
}

std::optional<int> number(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

void collect_holders(AccessFacts& facts, const SystemPaths& paths) {
  facts.all_processes_seen = true;
  std::error_code error;
  for (fs::directory_iterator process(paths.proc, error), end; !error && process != end;
       process.increment(error)) {
    const auto pid = number(process->path().filename().string());
    if (!pid) continue;
    std::error_code unreadable;
    for (fs::directory_iterator file(process->path() / "fd", unreadable); !unreadable && file != end;
         file.increment(unreadable)) {
      std::error_code closed;
      if (fs::read_symlink(file->path(), closed) != facts.node) continue;
      facts.holders.push_back({*pid, first_line(process->path() / "comm"), *pid == getpid()});
      break;
    }
    if (unreadable == std::errc::permission_denied) facts.all_processes_seen = false;
  }
}

std::vector<std::string> names_of_vendor(const UsbContext& context, std::uint16_t vendor) {
  std::vector<std::string> names;
  for (const UsbDevice& device : context.devices({.vendor = vendor})) names.push_back(name_of(device));
  return names;
}

std::string joined(const std::vector<std::string>& parts) {
  std::string all;
  for (const std::string& part : parts) all += (all.empty() ? "" : ", ") + part;
  return all;
}

std::string octal(unsigned mode) {
  std::array<char, 8> text{};
  (void)std::snprintf(text.data(), text.size(), "%04o", mode);
  return text.data();
}

std::string how_to_be_let_in(const AccessFacts& facts) {
  if (facts.rules_installed.empty()) {
    return (facts.rules_file.empty()
                ? "install a udev rule for " + ids_of(facts.device) + R"( with MODE="0660", GROUP="plugdev")"
                : "install the rule udev/" + facts.rules_file + ": copy it to /etc/udev/rules.d") +
           ", run \"sudo udevadm control --reload\" and plug the device in again";
  }
  const bool applied = facts.node_group != "root" && (facts.node_mode & kGroupMayUse) == kGroupMayUse;
  if (!applied) {
    return "the rule " + facts.rules_installed +
           " is installed but was not applied to this node: run \"sudo udevadm control --reload\" and plug "
           "the device in again";
  }
  if (facts.in_group) {
    return "group " + facts.node_group +
           " may use it and this process is in it: see whether a container or a security module forbids it";
  }
  if (facts.listed_in_group) {
    return facts.user + " is in group " + facts.node_group +
           " but this session began before that: log out and in again";
  }
  return "add yourself to the group: \"sudo adduser " + facts.user + " " + facts.node_group +
         "\"; then log out and in again";
}

/// Some devices are looked up by their vendor only.
std::string asked_for(const UsbDevice& device) {
  const std::string ids = ids_of(device);
  return device.product == 0 ? "device of vendor " + ids.substr(0, ids.find(':')) : ids;
}

AccessVerdict in_use(const AccessFacts& facts) {
  std::vector<std::string> names;
  for (const NodeHolder& holder : facts.holders) {
    names.push_back(holder.is_this_process ? "this program itself"
                                           : holder.command + " (pid " + std::to_string(holder.pid) + ")");
  }
  const std::string interface = "interface " + std::to_string(facts.interface) + " in use by ";
  if (!names.empty()) return {Access::kInUse, interface + joined(names), "end it, then try again"};
  return {Access::kInUse,
          interface + (facts.all_processes_seen ? "another program" : "another user's program"),
          "end what else uses the device, a vendor's service or another instance; \"sudo lsof " + facts.node +
              "\" names it"};
}

}  // namespace

std::string kernel_driver_of(const UsbDevice& device, int interface, const SystemPaths& paths) {
  const std::string configuration = first_line(sysfs_folder(device, paths) / "bConfigurationValue");
  const fs::path link = paths.sys / "bus/usb/devices" /
                        (device.port_path + ":" + configuration + "." + std::to_string(interface)) / "driver";
  std::error_code none;
  return fs::read_symlink(link, none).filename().string();
}

AccessFacts collect_access_facts(const UsbContext& context, const UsbDevice& device, int interface,
                                 const std::string& rules_file) {
  const SystemPaths& paths = context.paths();
  AccessFacts facts;
  facts.device = device;
  facts.interface = interface;
  // Not by libusb's list: it omits a device whose node it could not find.
  facts.on_bus =
      first_line(sysfs_folder(device, paths) / "devnum") == std::to_string(static_cast<int>(device.address));
  facts.same_vendor = names_of_vendor(context, device.vendor);
  collect_node(facts, paths);
  facts.rules_file = rules_file;
  facts.rules_installed = find_rules(rules_file, paths);
  facts.driver = kernel_driver_of(device, interface, paths);
  collect_holders(facts, paths);
  return facts;
}

AccessFacts absence_facts(const UsbContext& context, const UsbDevice& wanted) {
  AccessFacts facts;
  facts.device = wanted;
  facts.same_vendor = names_of_vendor(context, wanted.vendor);
  return facts;
}

AccessVerdict judge_access(const AccessFacts& facts) {
  if (!facts.on_bus) {
    const std::string others =
        facts.same_vendor.empty() ? "" : "; of this vendor there is " + joined(facts.same_vendor);
    return {
        Access::kNotOnBus, "no " + asked_for(facts.device) + " on the bus" + others,
        "check that it is switched on and its USB cable plugged in; try another cable and USB port, without "
        "a hub; \"lsusb\" lists what the kernel sees"};
  }
  if (!facts.node_there && !facts.node_folder_there) {
    return {
        Access::kNoNode, "the device, but no folder for " + facts.node,
        "in a container, give it /dev/bus/usb and allow character devices of major number 189; elsewhere, "
        "check that udev runs"};
  }
  if (!facts.node_there) {
    return {
        Access::kNoNode, "the device, but no node " + facts.node,
        "plug it in again; in a container, pass all of /dev/bus/usb on, because the node is a new one each "
        "time"};
  }
  if (!facts.may_use_node) {
    return {Access::kDenied,
            facts.node + " with mode " + octal(facts.node_mode) + ", owner " + facts.node_owner + ", group " +
                facts.node_group + ", and user " + facts.user + (facts.in_group ? " in" : " not in") +
                " that group",
            how_to_be_let_in(facts)};
  }
  constexpr const char* kClaimedByProgram = "usbfs";
  if (!facts.driver.empty() && facts.driver != kClaimedByProgram) {
    return {
        Access::kDriverBound,
        "the kernel's driver " + facts.driver + " bound to interface " + std::to_string(facts.interface),
        "it is taken off while this software uses the device; if that is refused, take it off by hand: echo "
        "-n " +
            facts.device.port_path + ":1." + std::to_string(facts.interface) +
            " | sudo tee /sys/bus/usb/drivers/" + facts.driver + "/unbind"};
  }
  if (facts.claim_refused || facts.driver == kClaimedByProgram) return in_use(facts);
  return {Access::kFree, facts.node + " may be read and written", ""};
}

}  // namespace drivers::usb
