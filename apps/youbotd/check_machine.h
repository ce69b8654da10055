/// @file
/// Checks whether the kernel of this machine suits a 1 kHz loop. All data comes from files, whose directories
/// are parameters.
#pragma once
#include <optional>

#include "apps/youbotd/finding.h"
#include "drivers/usb/system_paths.h"

namespace youbotd {

/// Whether the kernel is fully preemptible.
Finding check_kernel(const drivers::usb::SystemPaths& paths);

/// Duration of reading the clock, which the loop does several times per cycle.
Finding check_clock_source(const drivers::usb::SystemPaths& paths);

/// The share of the time that the kernel leaves to real-time threads. `busy_wait`: the loop occupies a whole
/// core.
Finding check_throttling(bool busy_wait, const drivers::usb::SystemPaths& paths);

/// Whether the cores keep their frequency while the loop sleeps: the loop's core, or all if it is not pinned.
/// Empty if the kernel does not change it.
std::optional<Finding> check_governor(std::optional<int> cpu, const drivers::usb::SystemPaths& paths);

}  // namespace youbotd
