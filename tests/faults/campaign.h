/// @file
/// Runs scripts from start to end, judges them, and shrinks failing ones.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/faults/script.h"

namespace faults {

struct Outcome {
  std::vector<std::string> violations;  ///< empty: safe and alive
  std::uint64_t digest = 0;             ///< the same for the same script
  nanoseconds emulated{};
  /// For scripts with one event: from it to the last torque, and the daemon's reason.
  std::optional<std::chrono::milliseconds> last_torque_after{};
  double travel_m = 0.0;  ///< of the base, likewise
  std::string fault{};
};

/// Starts the daemon, runs the script's events, and then expects that an enable works within 2 s and that the
/// robot moves and stops on command.
Outcome run(const Script& script, const Sabotage& sabotage = {});

/// The shortest script that still fails according to `fails`, by removing events and then simplifying them.
Script shrunk(const Script& script, const std::function<bool(const Script&)>& fails);

}  // namespace faults
