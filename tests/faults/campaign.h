/// @file
/// Runs scripts: begin to end, judged, and shrunk when they show a defect.
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
  /// Of scripts with one event: from it to the last torque, and what the daemon gave as the reason.
  std::optional<std::chrono::milliseconds> last_torque_after{};
  double travel_m = 0.0;  ///< of the base, likewise
  std::string fault{};
};

/// Starts the daemon, lets the script's events come and go, and then expects that an enable works within 2 s
/// and that the robot moves and stops as asked.
Outcome run(const Script& script, const Sabotage& sabotage = {});

/// The shortest script that still fails as `fails` says, by leaving out events and then by simplifying
/// them.
Script shrunk(const Script& script, const std::function<bool(const Script&)>& fails);

}  // namespace faults
