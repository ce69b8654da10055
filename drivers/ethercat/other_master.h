/// @file
/// Evidence of another EtherCAT master on our bus.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
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
  /// left on the wire, and one may be damaged: only those that keep coming from one source are a master's,
  /// also between the frames of others.
  void note_frame(MacAddress source, std::chrono::nanoseconds now) noexcept;
  /// What only a master writes, and we did not.
  struct Order {
    std::uint16_t slave = 0;  ///< position on the bus, from 1
    std::uint16_t register_address = 0;
  };
  /// A slave shows that it was given such an order: a state, or a register that does not hold what we wrote.
  void note_order(Order order, std::chrono::nanoseconds now) noexcept;

  /// Whether it was at work within the last second.
  bool present(std::chrono::nanoseconds now) const noexcept;
  /// Setup: "another EtherCAT master is on this bus (57 frames from 01:01:01:01:01:01): ...", with what to
  /// do. Of those at work last, the one with the most frames; and the last order, when it is as new.
  std::string describe() const;
  /// Setup: "01:01:01:01:01:01", as its frames say.
  std::string source() const;

 private:
  /// So many may take turns and are each found.
  static constexpr std::size_t kMostSenders = 4;

  struct Sender {
    MacAddress source{};
    std::uint64_t frames = 0;
    std::uint64_t weight = 0;  // its frames, less those that came from too many others; 0: a free place
    std::chrono::nanoseconds first{};
    std::chrono::nanoseconds last{};

    bool recent(std::chrono::nanoseconds now) const noexcept;
    bool keeps_coming() const noexcept;
  };
  /// Null: none yet.
  const Sender* most_frames() const noexcept;
  std::string order_text() const;

  std::array<Sender, kMostSenders> senders_{};
  bool ordered_ = false;
  Order order_;
  std::chrono::nanoseconds last_order_{};
};

}  // namespace drivers::ethercat
