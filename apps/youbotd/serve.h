/// @file
/// A Service on this machine: devices, control socket, log, and the real-time thread of its loop.
#pragma once
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "apps/youbotd/service.h"

namespace youbotd {

struct ServeOptions {
  ServiceOptions service;
  std::filesystem::path control_socket;
  bool allow_non_real_time = false;
  std::optional<std::string> page{};    ///< where it is served, as live::WebServer
  std::optional<std::uint32_t> ros2{};  ///< the domain
};

/// Runs until `stop` becomes true, then brings the robot to rest. Blocks. Nothing waits for the log: if its
/// reader hangs, lines are lost and counted.
/// @throws hal::SetupError if robot, haptic device or socket cannot be opened, or real-time was refused and
/// is not waived; std::invalid_argument for an invalid configuration.
void serve(const ServeOptions& options, const std::atomic<bool>& stop);

}  // namespace youbotd
