/// @file
/// `youbot-bench usb-probe`: which haptic masters are plugged in, what they say of themselves, and whether
/// they can be used. Opens, claims and sends nothing: all of it is the kernel's copy.
#pragma once
#include <atomic>
#include <filesystem>
#include <string>

#include "apps/youbot_bench/subcommand.h"

namespace youbot_bench {

struct UsbProbeOptions {
  std::string vendor{};         ///< hexadecimal, empty: any
  std::string product{};        ///< the same
  bool all = false;             ///< also what is no haptic master
  std::filesystem::path out{};  ///< the report goes there, too
  bool watch = false;           ///< go on, and tell who comes and goes
};

/// Prints the report; with `watch` until `stop`. @throws std::invalid_argument for a number that is none,
/// std::runtime_error saying what to check when nothing was found.
void usb_probe(const UsbProbeOptions& options, const std::atomic<bool>& stop);

Subcommand add_usb_probe(CLI::App& app);

}  // namespace youbot_bench
