/// @file
/// `youbot-bench usb-probe`: lists the connected haptic devices with their descriptors, and whether they can
/// be used. Opens, claims and sends nothing: all data is the kernel's copy.
#pragma once
#include <atomic>
#include <filesystem>
#include <string>

#include "apps/youbot_bench/subcommand.h"

namespace youbot_bench {

struct UsbProbeOptions {
  std::string vendor{};         ///< hexadecimal, empty: any
  std::string product{};        ///< the same
  bool all = false;             ///< also devices that are not haptic devices
  std::filesystem::path out{};  ///< also write the report to this file
  bool watch = false;           ///< continue, and report arrivals and removals
};

/// Prints the report; with `watch` until `stop`. @throws std::invalid_argument for an invalid number,
/// std::runtime_error with advice if nothing was found.
void usb_probe(const UsbProbeOptions& options, const std::atomic<bool>& stop);

Subcommand add_usb_probe(CLI::App& app);

}  // namespace youbot_bench
