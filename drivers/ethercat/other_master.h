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

/// Slaves answer to anyone, so a second master on the same interface, switch or line is visible through
/// frames that we did not send. A master with hidden frames, such as a driver below the raw socket, is
/// visible through its effects on the slaves. A plain value; cycle-safe except describe().
class OtherMaster {
 public:
  /// A frame from `source`, which is not ours, was received. A short burst may be left over from a program
  /// that has ended, and a frame may be damaged. Only frames that keep arriving from one source belong to a
  /// master, even between the frames of others.
  void note_frame(MacAddress source, std::chrono::nanoseconds now) noexcept;
  /// A write that only a master makes, and we did not.
  struct Order {
    std::uint16_t slave = 0;  ///< position on the bus, from 1
    std::uint16_t register_address = 0;
  };
  /// A slave shows the effect of such a write: a state, or a register that does not hold our value.
  void note_order(Order order, std::chrono::nanoseconds now) noexcept;

  /// True if it was active within the last second.
  bool present(std::chrono::nanoseconds now) const noexcept;
  /// Setup: "another EtherCAT master is on this bus (57 frames from 01:01:01:01:01:01): ...", with advice. Of
  /// the masters active last, the one with the most frames; and the last order, if it is as recent.
  std::string describe() const;
  /// Setup: "01:01:01:01:01:01", the source of its frames.
  std::string source() const;

 private:
  /// This many masters may send in turn and are all found.
  static constexpr std::size_t kMaxSenders = 4;

  struct Sender {
    MacAddress source{};
    std::uint64_t frames = 0;
    std::uint64_t weight = 0;  // its frames, minus those of too many others; 0: a free place
    std::chrono::nanoseconds first{};
    std::chrono::nanoseconds last{};

    bool recent(std::chrono::nanoseconds now) const noexcept;
    bool keeps_coming() const noexcept;
  };
  /// Null: none yet.
  const Sender* most_frames() const noexcept;
  std::string order_text() const;

  std::array<Sender, kMaxSenders> senders_{};
  bool ordered_ = false;
  Order order_;
  std::chrono::nanoseconds last_order_{};
};

}  // namespace drivers::ethercat
