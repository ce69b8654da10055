/// @file
/// Whether a network interface can be the robot's EtherCAT bus. No frame is sent.
#pragma once
#include <string>

#include "apps/youbotd/finding.h"
#include "drivers/usb/system_paths.h"

namespace youbotd {

/// What the kernel's files say of it.
Finding check_interface(const std::string& interface, const drivers::usb::SystemPaths& paths);

/// Whether other traffic goes over it: this machine's addresses there.
Finding check_addresses(const std::string& interface);

/// Opens it as the EtherCAT master does.
Finding check_raw_socket(const std::string& interface);

}  // namespace youbotd
