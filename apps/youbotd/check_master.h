/// @file
/// Checks whether the configured haptic device is present and usable. Nothing is sent to it.
#pragma once
#include "apps/youbotd/finding.h"
#include "drivers/usb/system_paths.h"
#include "runtime/open_haptic.h"

namespace youbotd {

/// For a device known to runtime::open_haptic(). Empty for the simulated one.
Findings check_master(const runtime::HapticOptions& options, const drivers::usb::SystemPaths& paths);

}  // namespace youbotd
