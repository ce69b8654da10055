/// @file
/// Evidence of another EtherCAT master on our bus.
#pragma once
#include <chrono>
#include <cstdint>
#include <string>

#include "drivers/ethercat/frame.h"

namespace drivers::ethercat {

/// Slaves answer to everybody, so a second master on the same interface, switch or line shows by frames that
/// we did not send. One that hides its frames, such as a driver below the raw socket, shows by what it does
/// to the slaves. A plain value; cycle-safe but for describe().
class OtherMaster {
 public:
  /// A frame from `source` came in, which is not ours. A few at once may be what a program that has ended
  /// left on the wire, and one may be damaged: only those that keep coming from one source are a master's.
  void note_frame(MacAddress source, std::chrono::nanoseconds now) noexcept;
  /// A slave has a state or a station address that only a master gives, and we did not.
  void note_order(std::chrono::nanoseconds now) noexcept;

  /// Whether it was at work within the last second.
  bool present(std::chrono::nanoseconds now) const noexcept;
  /// Setup: "another EtherCAT master is on this bus (57 frames from 01:01:01:01:01:01): ...", with what to
  /// do.
  std::string describe() const;
  /// Setup: "01:01:01:01:01:01", as its frames say.
  std::string source() const;

 private:
  MacAddress source_{};
  std::uint64_t frames_ = 0;  // in a row from there
  std::chrono::nanoseconds first_{};
  std::chrono::nanoseconds last_{};
  bool ordered_ = false;
  std::chrono::nanoseconds last_order_{};
};

}  // namespace drivers::ethercat
