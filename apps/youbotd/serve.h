/// @file
/// A Service on this machine: its devices, its control socket, its log, and the real-time thread of its loop.
#pragma once
#include <atomic>
#include <filesystem>

#include "apps/youbotd/service.h"

namespace youbotd {

struct ServeOptions {
  ServiceOptions service;
  std::filesystem::path control_socket;
  bool allow_non_real_time = false;
};

/// Runs until `stop` becomes true, then brings the robot to rest. Blocks. Nothing waits for the log: when its
/// reader hangs, lines are lost and counted.
/// @throws hal::SetupError when robot, master or socket cannot be opened, or real-time was refused and is not
///         waived; std::invalid_argument for a configuration no part accepts.
void serve(const ServeOptions& options, const std::atomic<bool>& stop);

}  // namespace youbotd
