/// @file
/// Checks whether a network interface can be the robot's EtherCAT bus. No frame is sent.
#pragma once
#include <string>

#include "apps/youbotd/finding.h"
#include "drivers/usb/system_paths.h"

namespace youbotd {

/// From the kernel's files.
Finding check_interface(const std::string& interface, const drivers::usb::SystemPaths& paths);

/// Whether it carries other traffic: addresses of this machine on it.
Finding check_addresses(const std::string& interface);

/// Opens it like the EtherCAT master.
Finding check_raw_socket(const std::string& interface);

}  // namespace youbotd
