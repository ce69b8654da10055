/// @file
/// Distributed clocks: one time on all slaves (ETG.1000.4, section 5.5; ESC data sheet section I, chapter 9).
///
/// A frame enters a slave at port 0, leaves and comes back at its open ports in the order 3, 1, 2, and goes
/// back at port 0. A write to 0x0900 makes every slave latch its own time at each port. With the slave before
/// on the cable as P, the port to slave S as b, and the port the frame left P by before that as a:
///
///   delay(S) = delay(P) + [t_P(a) - t_P(0)] + ([t_P(b) - t_P(a)] - [t_S(last) - t_S(0)]) / 2
///
/// half the loop through the cable, as long in both directions, and before it the branches served earlier.
/// Each slave then shows  system time = local time + offset  (0x0920), and compares, less its delay (0x0928),
/// with the reference's time that FRMW carries to it; the difference steers its clock.
///
/// Off by default: the youBot's slaves do not work with it. Who wants it:
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

/// What one slave latched when 0x0900 was written; zero for one without a clock.
struct ClockLatch {
  std::array<std::uint32_t, 4> port_time_ns{};  ///< 0x0900, 0x0904, 0x0908, 0x090C
  std::uint64_t local_time_ns = 0;              ///< 0x0918: at port 0, in full width where there is one
};

/// One slave's share. `offset_ns` counts modulo 2^64, or 2^32 for a short clock.
struct ClockSetting {
  bool has_clock = false;
  std::uint32_t delay_ns = 0;   ///< from the reference clock
  std::uint64_t offset_ns = 0;  ///< local time + offset = system time
  friend bool operator==(const ClockSetting&, const ClockSetting&) = default;
};

struct ClockPlan {
  std::optional<std::size_t> reference;  ///< the first slave with a clock: FRMW reaches all behind it
  std::vector<ClockSetting> slaves;      ///< as many as there are slaves
  std::vector<std::string> doubts;       ///< what looks wrong in the measurement, in words
};

/// @param system_time_ns what the reference clock is to show at the moment it latched
ClockPlan plan_clocks(std::span<const Slave> slaves, std::span<const ClockLatch> latches,
                      std::uint64_t system_time_ns);

struct ClockWrite {
  std::size_t slave = 0;  ///< from 0
  std::uint16_t address = 0;
  std::uint8_t length = 0;
  std::array<std::uint8_t, 8> data{};
};
/// Offset, delay, and the speed counter, whose writing resets the slave's control loop, in this order.
std::vector<ClockWrite> register_writes(const ClockPlan& plan);

/// Registers 0x092C of a slave: how far its clock is ahead of the reference, filtered.
std::chrono::nanoseconds decode_time_difference(std::uint32_t value) noexcept;

inline constexpr std::size_t kClockBytes = 8;  ///< of system time, carried by one datagram a cycle

class DistributedClocks {
 public:
  /// Setup: latches, plans and writes. `slaves` have their station addresses.
  /// @throws BusError when a slave with a clock does not answer.
  DistributedClocks(RegisterAccess& access, std::span<const Slave> slaves, std::uint64_t system_time_ns);

  const ClockPlan& plan() const noexcept { return plan_; }
  bool active() const noexcept { return plan_.reference.has_value(); }

  /// Setup: distributes the reference time so many times, for the slaves to find its rate.
  void settle(RegisterAccess& access, int frames) const;
  /// Setup: how far the worst clock is off; none without a clock to compare.
  std::chrono::nanoseconds worst_difference(RegisterAccess& access) const;

  /// Cycle: adds the FRMW that carries the reference's time to all; false when inactive or without room.
  bool add(FrameWriter& writer, std::uint8_t index) const noexcept;
  /// Cycle: takes its answer. False when a clock did not get it, as the working counter tells.
  bool answer(const Datagram& datagram) noexcept;
  /// The reference's system time as the last frame passed it.
  std::uint64_t system_time_ns() const noexcept { return system_time_ns_; }

 private:
  std::vector<std::uint16_t> stations_;  // of those with a clock; the reference comes first
  ClockPlan plan_;
  std::uint64_t system_time_ns_ = 0;
};

}  // namespace drivers::ethercat
