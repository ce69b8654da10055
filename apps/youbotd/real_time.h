/// @file
/// Makes the calling thread fit for a 1 kHz cycle, or says why not.
#pragma once
#include <optional>
#include <string>
#include <vector>

namespace youbotd {

struct RealTimeConfig {
  int priority = 80;         ///< SCHED_FIFO, 1 to 99
  std::optional<int> cpu{};  ///< core to pin the cycle to
};

/// Locks memory, touches the stack, keeps the heap from shrinking, takes SCHED_FIFO and the core. Returns
/// what was refused, each with what to do about it; empty when the thread is real-time.
std::vector<std::string> enter_real_time(const RealTimeConfig& config);

/// Events of the calling thread that a cycle must not have.
struct Disturbances {
  long minor_faults = 0;
  long major_faults = 0;
  long voluntary_switches = 0;    ///< one per sleep is expected
  long involuntary_switches = 0;  ///< something else took the core
  static Disturbances of_this_thread() noexcept;
  Disturbances since(const Disturbances& earlier) const noexcept;
};

}  // namespace youbotd
