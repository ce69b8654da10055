/// @file
/// Common interface of the masters that ethercat_bench compares, and the measurement functions.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

namespace bench {

/// One master on one bus, from the open socket to the slaves' INIT.
class Master {
 public:
  Master() = default;
  Master(const Master&) = delete;
  Master& operator=(const Master&) = delete;
  virtual ~Master() = default;
  /// From any state of the slaves to OP. @throws std::runtime_error.
  virtual void bring_up() = 0;
  /// One cyclic frame; false unless it came back with the full working counter.
  virtual bool exchange() = 0;
  virtual std::uint64_t mailbox_replies() const { return 0; }
};

enum class Waiting : std::uint8_t { kBlock, kBusy };
/// kAll: every slave with a mailbox is asked for a parameter again as soon as it has replied.
enum class MailboxLoad : std::uint8_t { kNone, kAll };

std::unique_ptr<Master> make_our_master(const std::string& interface, Waiting waiting, MailboxLoad load);
bool built_with_soem();
std::unique_ptr<Master> make_soem_master(const std::string& interface);
bool built_with_kickcat();
std::unique_ptr<Master> make_kickcat_master(const std::string& interface);

std::chrono::nanoseconds now();
std::chrono::nanoseconds thread_cpu();
void sleep_until(std::chrono::nanoseconds time);
/// Gives this thread, and the processes it starts, real-time priority; false if the system refuses.
bool become_real_time();
/// Counted by the interface, so that masters need not count.
std::uint64_t frames_sent(const std::string& interface);

}  // namespace bench
