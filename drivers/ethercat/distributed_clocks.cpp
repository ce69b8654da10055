#include "drivers/ethercat/distributed_clocks.h"

#include <algorithm>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/registers.h"

namespace drivers::ethercat {
namespace {

using std::chrono::nanoseconds;

constexpr std::uint16_t kClockIs64Bit = 0x0008;  // in Slave::features
constexpr std::uint16_t kSpeedCounterStart = 0x1000;
constexpr std::size_t kLatchBytes = 0x20;  // 0x0900 to 0x091F
constexpr std::uint32_t kSignOfDifference = 0x8000'0000;
/// 10 km of cable one way: a longer time is not a delay but a measurement error.
constexpr std::int64_t kLongestHop = 50'000;
constexpr std::int64_t kLongestBranch = 1'000'000;  // hundreds of slaves

/// The port by which the frame arrived or returned before it left by `port`; port 0 at the earliest.
std::uint8_t port_before(const Slave& slave, std::uint8_t port) noexcept {
  std::uint8_t before = 0;
  for (const std::uint8_t candidate : kPortOrder) {
    if (candidate == port) break;
    if (slave.communicates(candidate)) before = candidate;
  }
  return before;
}
std::uint8_t last_port(const Slave& slave) noexcept { return port_before(slave, 0); }

/// Local clocks count modulo 2^32 ns; differences are short.
std::int64_t elapsed(const ClockLatch& latch, std::uint8_t from, std::uint8_t to) noexcept {
  return latch.port_time_ns[to] - latch.port_time_ns[from];
}

/// The nearest slave with a clock on the path to the master, and the port by which the path leaves it.
struct Ancestor {
  std::size_t slave;
  std::uint8_t port;
  bool direct;  // no slave without clock in between
};
std::optional<Ancestor> clock_before(std::span<const Slave> slaves, std::size_t slave) noexcept {
  const Slave* at = &slaves[slave];
  for (bool direct = true; at->parent > 0 && at->parent <= slaves.size() && at->parent < at->position;
       direct = false) {
    const std::size_t parent = at->parent - std::size_t{1};
    if (slaves[parent].has_distributed_clock()) return Ancestor{parent, at->parent_port, direct};
    at = &slaves[parent];
  }
  return std::nullopt;
}

}  // namespace

ClockPlan plan_clocks(std::span<const Slave> slaves, std::span<const ClockLatch> latches,
                      std::uint64_t system_time_ns) {
  ClockPlan plan;
  plan.slaves.resize(slaves.size());
  for (std::size_t i = 0; i < std::min(slaves.size(), latches.size()); ++i) {
    const Slave& slave = slaves[i];
    if (!slave.has_distributed_clock()) continue;
    ClockSetting& setting = plan.slaves[i];
    setting.has_clock = true;
    if (!plan.reference) {
      plan.reference = i;
      setting.offset_ns = system_time_ns - latches[i].local_time_ns;
      continue;
    }
    if (const auto before = clock_before(slaves, i)) {
      const Slave& parent = slaves[before->slave];
      const ClockLatch& at_parent = latches[before->slave];
      const std::uint8_t left_by = port_before(parent, before->port);
      const std::int64_t branches = elapsed(at_parent, 0, left_by);
      const std::int64_t loop = elapsed(at_parent, left_by, before->port);
      const std::int64_t inside = elapsed(latches[i], 0, last_port(slave));
      const std::int64_t hop = (loop - inside) / 2;
      setting.delay_ns = plan.slaves[before->slave].delay_ns;
      if (hop < 0 || hop > kLongestHop || branches > kLongestBranch)
        plan.doubts.push_back(slave.label() + ": " + std::to_string(branches + hop) + " ns from " +
                              parent.label() + " port " + std::to_string(before->port) +
                              " cannot be: is a cable in the wrong port, or was a frame latched twice?");
      else
        setting.delay_ns += static_cast<std::uint32_t>(branches + hop);
      if (!before->direct)
        plan.doubts.push_back(slave.label() + ": slaves without clock lie between it and " + parent.label() +
                              "; right only if they form a line");
    } else {
      plan.doubts.push_back(slave.label() +
                            ": no slave with a clock lies between it and the master; its "
                            "delay from the reference is unknown and taken as 0");
    }
    // The same frame passed the reference at system_time_ns and this slave `delay` later.
    setting.offset_ns = system_time_ns + setting.delay_ns - latches[i].local_time_ns;
    if ((slave.features & kClockIs64Bit) == 0) setting.offset_ns &= 0xFFFF'FFFF;
  }
  return plan;
}

std::vector<ClockWrite> register_writes(const ClockPlan& plan) {
  std::vector<ClockWrite> writes;
  for (std::size_t i = 0; i < plan.slaves.size(); ++i) {
    const ClockSetting& setting = plan.slaves[i];
    if (!setting.has_clock) continue;
    ClockWrite offset{i, reg::kDcSystemTimeOffset, 8, {}};
    store_le(offset.data.data(), setting.offset_ns);
    ClockWrite delay{i, reg::kDcSystemTimeDelay, 4, {}};
    store_le(delay.data.data(), setting.delay_ns);
    ClockWrite speed{i, reg::kDcSpeedCounterStart, 2, {}};
    store_le(speed.data.data(), kSpeedCounterStart);
    writes.insert(writes.end(), {offset, delay, speed});
  }
  return writes;
}

nanoseconds decode_time_difference(std::uint32_t value) noexcept {
  const nanoseconds magnitude{value & ~kSignOfDifference};
  return (value & kSignOfDifference) != 0 ? -magnitude : magnitude;
}

DistributedClocks::DistributedClocks(RegisterAccess& access, std::span<const Slave> slaves,
                                     std::uint64_t system_time_ns) {
  (void)access.broadcast_write(reg::kDcReceiveTimes, std::array<std::uint8_t, 4>{});

  std::vector<ClockLatch> latches(slaves.size());
  access.each(
      slaves.size(), [&](std::size_t i) { return !slaves[i].has_distributed_clock(); },
      [&](FrameWriter& writer, std::uint8_t index, std::size_t i) {
        return writer
                   .add(Command::kFprd, index, address_of(slaves[i].station, reg::kDcReceiveTimes),
                        kLatchBytes)
                   .counter != nullptr;
      },
      [&](const Datagram& datagram, std::size_t i) {
        if (datagram.working_counter() != 1)
          throw BusError(slaves[i].label(), "read its receive times", "it does not answer");
        for (std::size_t port = 0; port < latches[i].port_time_ns.size(); ++port)
          latches[i].port_time_ns[port] = load_le<std::uint32_t>(&datagram.data[4 * port]);
        latches[i].local_time_ns =
            load_le<std::uint64_t>(&datagram.data[reg::kDcReceiveTimeUnit - reg::kDcReceiveTimes]);
      });
  plan_ = plan_clocks(slaves, latches, system_time_ns);

  const std::vector<ClockWrite> writes = register_writes(plan_);
  access.each(
      writes.size(), [](std::size_t) { return false; },
      [&](FrameWriter& writer, std::uint8_t index, std::size_t i) {
        const ClockWrite& write = writes[i];
        const Datagram datagram = writer.add(
            Command::kFpwr, index, address_of(slaves[write.slave].station, write.address), write.length);
        std::copy_n(write.data.begin(), datagram.data.size(), datagram.data.begin());
        return datagram.counter != nullptr;
      },
      [&](const Datagram& datagram, std::size_t i) {
        if (datagram.working_counter() != 1)
          throw BusError(slaves[writes[i].slave].label(), "set its clock", "it does not answer");
      });
  for (std::size_t i = 0; i < slaves.size(); ++i)
    if (plan_.slaves[i].has_clock) stations_.push_back(slaves[i].station);
}

bool DistributedClocks::add(FrameWriter& writer, std::uint8_t index) const noexcept {
  return active() &&
         writer.add(Command::kFrmw, index, address_of(stations_.front(), reg::kDcSystemTime), kClockBytes)
                 .counter != nullptr;
}

bool DistributedClocks::answer(const Datagram& datagram) noexcept {
  if (!active() || datagram.data.size() != kClockBytes || datagram.working_counter() == 0) return false;
  system_time_ns_ = load_le<std::uint64_t>(datagram.data.data());
  // Read once, written to every other slave: slaves without a clock count as well, so this is the minimum.
  return datagram.working_counter() >= stations_.size();
}

void DistributedClocks::settle(RegisterAccess& access, int frames) const {
  if (!active()) return;
  for (int i = 0; i < frames; ++i)
    access.each(
        1, [](std::size_t) { return false; },
        [&](FrameWriter& writer, std::uint8_t index, std::size_t) { return add(writer, index); },
        [](const Datagram&, std::size_t) {});
}

nanoseconds DistributedClocks::worst_difference(RegisterAccess& access) const {
  nanoseconds worst{};
  access.each(
      stations_.size(), [](std::size_t i) { return i == 0; },
      [&](FrameWriter& writer, std::uint8_t index, std::size_t i) {
        return writer.add(Command::kFprd, index, address_of(stations_[i], reg::kDcSystemTimeDifference), 4)
                   .counter != nullptr;
      },
      [&](const Datagram& datagram, std::size_t) {
        if (datagram.working_counter() != 1) return;
        worst = std::max(
            worst, std::chrono::abs(decode_time_difference(load_le<std::uint32_t>(datagram.data.data()))));
      });
  return worst;
}

}  // namespace drivers::ethercat
