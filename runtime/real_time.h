/// @file
/// Prepares the calling thread for a 1 kHz cycle, or reports why it cannot.
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

/// Real-time scheduling of the calling thread, reset by the destructor so that the work after the loop
/// (closing files, another run) does not have it or pass it on to new threads. Locked memory stays locked.
class RealTimeThread {
 public:
  RealTimeThread();
  ~RealTimeThread();
  RealTimeThread(const RealTimeThread&) = delete;
  RealTimeThread& operator=(const RealTimeThread&) = delete;

  /// Locks memory, touches the stack, keeps the heap from shrinking, takes SCHED_FIFO and the core. Returns
  /// what was refused, each with advice; empty if the thread is real-time.
  std::vector<std::string> enter(const RealTimeConfig& config);

 private:
  int policy_ = SCHED_OTHER;
  sched_param parameters_{};
  cpu_set_t cpus_{};
};

/// Events of the calling thread that disturb a cycle.
struct Disturbances {
  long minor_faults = 0;
  long major_faults = 0;
  long voluntary_switches = 0;    ///< one per sleep is expected
  long involuntary_switches = 0;  ///< another thread took the core
  static Disturbances of_this_thread() noexcept;
  Disturbances since(const Disturbances& earlier) const noexcept;
};

}  // namespace runtime
