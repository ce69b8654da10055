/// @file
/// Whether the configured haptic master is there and may be used. Nothing is sent to it.
#pragma once
#include "apps/youbotd/finding.h"
#include "drivers/usb/system_paths.h"
#include "runtime/open_haptic.h"

namespace youbotd {

/// A master that runtime::open_haptic() knows. None of the simulated one.
Findings check_master(const runtime::HapticOptions& options, const drivers::usb::SystemPaths& paths);

}  // namespace youbotd
