/// @file
/// Which HID devices the kernel has, as sysfs shows them. Opens no device and sends nothing. Setup:
/// everything.
///
/// hidapi 0.13.1 (Debian 12) lists devices, too, but crashes when it cannot read a property of one of them.
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "drivers/usb/system_paths.h"

namespace drivers::haptic {

struct HidNode {
  std::string path = {};              ///< "/dev/hidraw3"
  std::filesystem::path folder = {};  ///< of the HID device in sysfs
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string serial = {};  ///< HID_UNIQ: a serial number, over Bluetooth an address, often empty. ASCII
};

/// By number. Left out are a device that goes meanwhile, one without ids, and one whose ids cannot be read:
/// it hides no other. @throws SetupError when sysfs cannot be read, or this process may open no more files.
std::vector<HidNode> hid_nodes(const usb::SystemPaths& paths = {});

/// Empty when the kernel shows none or the device is gone. @throws SetupError when it cannot be read.
std::vector<std::uint8_t> report_descriptor_of(const HidNode& node);

/// A usage page and a usage on it (HID Usage Tables).
struct HidUsage {
  std::uint16_t page = 0;
  std::uint16_t usage = 0;
  bool operator==(const HidUsage&) const = default;
};

/// Whether a report descriptor (HID 1.11, 6.2.2) has a collection of that usage. Any bytes are legal.
bool has_collection(std::span<const std::uint8_t> report_descriptor, HidUsage wanted) noexcept;

}  // namespace drivers::haptic
