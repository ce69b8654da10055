/// @file
/// Distributed clocks: one time on all slaves (ETG.1000.4, section 5.5; ESC data sheet section I, chapter 9).
///
/// A frame enters a slave at port 0, leaves and returns at its open ports in the order 3, 1, 2, and leaves at
/// port 0. A write to 0x0900 makes every slave latch its own time at each port. With P the slave before S on
/// the cable, b the port of P to S, and a the port by which the frame left P before that:
///
///   delay(S) = delay(P) + [t_P(a) - t_P(0)] + ([t_P(b) - t_P(a)] - [t_S(last) - t_S(0)]) / 2
///
/// The last term is half the loop through the cable, which takes equally long in both directions; the term
/// before it covers the branches served earlier. Each slave then shows system time = local time + offset
/// (0x0920), and compares it, minus its delay (0x0928), with the reference time that FRMW carries to it; the
/// difference steers its clock.
///
/// Off by default: the youBot's slaves do not work with it. Usage:
///
///   DistributedClocks clocks(access, slaves, system_time);      // set-up, in PRE-OP, before start()
///   clocks.settle(access, 1000);
///   each cycle: clocks.add(writer, index) first in the frame ... clocks.answer(datagram)
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/register_access.h"
#include "drivers/ethercat/slave.h"

namespace drivers::ethercat {

/// Times that one slave latched when 0x0900 was written; zero without a clock.
struct ClockLatch {
  std::array<std::uint32_t, 4> port_time_ns{};  ///< 0x0900, 0x0904, 0x0908, 0x090C
  std::uint64_t local_time_ns = 0;              ///< 0x0918: at port 0, 64 bits if supported
};

/// Setting of one slave. `offset_ns` counts modulo 2^64, or 2^32 for a short clock.
struct ClockSetting {
  bool has_clock = false;
  std::uint32_t delay_ns = 0;   ///< from the reference clock
  std::uint64_t offset_ns = 0;  ///< local time + offset = system time
  friend bool operator==(const ClockSetting&, const ClockSetting&) = default;
};

struct ClockPlan {
  std::optional<std::size_t> reference;  ///< the first slave with a clock: FRMW reaches all slaves after it
  std::vector<ClockSetting> slaves;      ///< one per slave
  std::vector<std::string> doubts;       ///< implausible measurements, as text
};

/// @param system_time_ns system time of the reference clock when it latched
ClockPlan plan_clocks(std::span<const Slave> slaves, std::span<const ClockLatch> latches,
                      std::uint64_t system_time_ns);

struct ClockWrite {
  std::size_t slave = 0;  ///< from 0
  std::uint16_t address = 0;
  std::uint8_t length = 0;
  std::array<std::uint8_t, 8> data{};
};
/// Offset, delay, and the speed counter, in this order; writing the last resets the slave's control loop.
std::vector<ClockWrite> register_writes(const ClockPlan& plan);

/// Register 0x092C of a slave: filtered lead of its clock over the reference.
std::chrono::nanoseconds decode_time_difference(std::uint32_t value) noexcept;

inline constexpr std::size_t kClockBytes = 8;  ///< of system time, carried by one datagram per cycle

class DistributedClocks {
 public:
  /// Setup: latches, plans and writes. `slaves` have their station addresses.
  /// @throws BusError if a slave with a clock does not answer.
  DistributedClocks(RegisterAccess& access, std::span<const Slave> slaves, std::uint64_t system_time_ns);

  const ClockPlan& plan() const noexcept { return plan_; }
  bool active() const noexcept { return plan_.reference.has_value(); }

  /// Setup: distributes the reference time in `frames` frames, for the slaves to find its rate.
  void settle(RegisterAccess& access, int frames) const;
  /// Setup: largest deviation of a clock; 0 if there is no clock to compare.
  std::chrono::nanoseconds worst_difference(RegisterAccess& access) const;

  /// Cycle: adds the FRMW that carries the reference time to all; false if inactive or without room.
  bool add(FrameWriter& writer, std::uint8_t index) const noexcept;
  /// Cycle: takes its answer. False if the working counter shows that a clock did not receive it.
  bool answer(const Datagram& datagram) noexcept;
  /// System time of the reference when the last frame passed it.
  std::uint64_t system_time_ns() const noexcept { return system_time_ns_; }

 private:
  std::vector<std::uint16_t> stations_;  // of those with a clock; the reference is first
  ClockPlan plan_;
  std::uint64_t system_time_ns_ = 0;
};

}  // namespace drivers::ethercat
