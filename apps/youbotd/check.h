/// @file
/// `youbotd --check`: whether this machine lets the configured robot and master run, and what to do where it
/// does not. Nothing moves and nothing is sent. What the configuration does not need is not looked at.
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "apps/youbotd/finding.h"
#include "drivers/usb/system_paths.h"
#include "operation/config.h"

namespace youbotd {

struct CheckOptions {
  std::optional<std::filesystem::path> record_directory{};
  bool virtual_time = false;
  bool allow_non_real_time = false;
  drivers::usb::SystemPaths paths{};
};

/// @throws std::invalid_argument for a configuration no part accepts.
Findings check(const operation::Config& config, const CheckOptions& options);

/// A line for each, what to do below it, and how many fail; or only those there is something to do about.
std::string report(const Findings& findings, bool only_problems);
/// An array of {mark, found, remedy}, of which mark is "ok", "warn" or "fail".
nlohmann::json json_of(const Findings& findings);

bool passed(const Findings& findings);

}  // namespace youbotd
