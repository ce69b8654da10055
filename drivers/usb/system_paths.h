/// @file
/// Directories of the kernel and udev. Tests replace each with their own.
#pragma once
#include <filesystem>
#include <vector>

namespace drivers::usb {

struct SystemPaths {
  std::filesystem::path sys = "/sys";
  std::filesystem::path proc = "/proc";
  std::filesystem::path dev = "/dev";
  std::vector<std::filesystem::path> rule_directories{"/etc/udev/rules.d", "/run/udev/rules.d",
                                                      "/usr/local/lib/udev/rules.d", "/usr/lib/udev/rules.d",
                                                      "/lib/udev/rules.d"};
};

}  // namespace drivers::usb
