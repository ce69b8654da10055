/// @file
/// `youbotd --check`: checks whether this machine can run the configured robot and haptic device, with
/// advice. Nothing moves: of a robot on EtherCAT, it reads the names of the devices before any of them
/// changes its state. Skips checks that the configuration does not need.
#pragma once
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "apps/youbotd/check_parts.h"
#include "drivers/usb/system_paths.h"
#include "operation/config.h"

namespace youbotd {

struct CheckOptions {
  std::optional<std::filesystem::path> record_directory{};
  runtime::RecordingFormat record_format{};
  bool virtual_time = false;
  bool allow_non_real_time = false;
  std::filesystem::path control_socket{};  ///< empty: none
  std::optional<std::string> page{};       ///< "HOST:PORT"
  std::optional<std::uint32_t> ros2{};     ///< the domain
  drivers::usb::SystemPaths paths{};
};

/// @throws std::invalid_argument for an invalid configuration.
Findings check(const operation::Config& config, const CheckOptions& options);

/// A line for each finding, with the advice below it, and the number of failures; optionally only findings
/// with advice.
std::string report(const Findings& findings, bool only_problems);
/// An array of {mark, found, remedy}, of which mark is "ok", "warn" or "fail".
nlohmann::json json_of(const Findings& findings);

bool passed(const Findings& findings);

}  // namespace youbotd
