/// @file
/// Result of udev's rules for a device: its node in /dev, group and mode, and who may open it.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>

namespace guest {

struct NodeAccess {
  mode_t mode = 0;    ///< permission bits, 0660
  std::string group;  ///< "plugdev"
  bool operator==(const NodeAccess&) const = default;
};
/// Prints the mode in octal in test failures.
void PrintTo(const NodeAccess& access, std::ostream* stream);

/// After udev has processed its rules for the node. Empty if it never does.
std::optional<NodeAccess> access_by_udev(const std::filesystem::path& node);

/// Waits until udev has processed all events, including the removal of a device whose number the next one may
/// get.
void settle_udev();

/// Whether a user without privileges can open it for reading and writing, as a member of this group or, by
/// default, of none.
bool opens_for_a_user(const std::filesystem::path& node, const char* group = "nogroup");

/// /dev/bus/usb/BBB/DDD of a device that is plugged in. Empty when there is none.
std::optional<std::filesystem::path> find_usb_node(unsigned vendor, unsigned product);
/// /dev/hidrawN, likewise.
std::optional<std::filesystem::path> find_hidraw_node(unsigned vendor, unsigned product);

}  // namespace guest
