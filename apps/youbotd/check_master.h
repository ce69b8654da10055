/// @file
/// Whether the configured haptic master is there and may be used. Nothing is sent to it.
#pragma once
#include "apps/common/open_haptic.h"
#include "apps/youbotd/finding.h"
#include "drivers/usb/system_paths.h"

namespace youbotd {

/// A master that apps::open_haptic() knows. None of the simulated one.
Findings check_master(const apps::HapticOptions& options, const drivers::usb::SystemPaths& paths);

}  // namespace youbotd
