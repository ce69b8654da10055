/// @file
/// Makes the calling thread fit for a 1 kHz cycle, or says why not.
#pragma once
#include <sched.h>

#include <optional>
#include <string>
#include <vector>

namespace runtime {

struct RealTimeConfig {
  int priority = 80;         ///< SCHED_FIFO, 1 to 99
  std::optional<int> cpu{};  ///< core to pin the cycle to
};

/// Real-time scheduling of the calling thread, given back at destruction so that what follows the loop
/// (closing files, another run) neither has it nor hands it on to new threads. Locked memory stays locked.
class RealTimeThread {
 public:
  RealTimeThread();
  ~RealTimeThread();
  RealTimeThread(const RealTimeThread&) = delete;
  RealTimeThread& operator=(const RealTimeThread&) = delete;

  /// Locks memory, touches the stack, keeps the heap from shrinking, takes SCHED_FIFO and the core. Returns
  /// what was refused, each with what to do about it; empty when the thread is real-time.
  std::vector<std::string> enter(const RealTimeConfig& config);

 private:
  int policy_ = SCHED_OTHER;
  sched_param parameters_{};
  cpu_set_t cpus_{};
};

/// Events of the calling thread that a cycle must not have.
struct Disturbances {
  long minor_faults = 0;
  long major_faults = 0;
  long voluntary_switches = 0;    ///< one per sleep is expected
  long involuntary_switches = 0;  ///< something else took the core
  static Disturbances of_this_thread() noexcept;
  Disturbances since(const Disturbances& earlier) const noexcept;
};

}  // namespace runtime
