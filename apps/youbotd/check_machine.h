/// @file
/// What the kernel of this machine is to a 1 kHz loop. Everything is read from files, whose folders are
/// parameters.
#pragma once
#include <optional>

#include "apps/youbotd/finding.h"
#include "drivers/usb/system_paths.h"

namespace youbotd {

/// Whether the kernel can be interrupted wherever it is.
Finding check_kernel(const drivers::usb::SystemPaths& paths);

/// How long it takes to read the time, which the loop does several times a cycle.
Finding check_clock_source(const drivers::usb::SystemPaths& paths);

/// The share of the time that the kernel leaves to real-time threads. `busy_wait`: the loop takes a whole
/// core.
Finding check_throttling(bool busy_wait, const drivers::usb::SystemPaths& paths);

/// Whether the cores keep their clock while the loop sleeps: the loop's, or all when it is not pinned. None
/// when the kernel does not change it.
std::optional<Finding> check_governor(std::optional<int> cpu, const drivers::usb::SystemPaths& paths);

}  // namespace youbotd
