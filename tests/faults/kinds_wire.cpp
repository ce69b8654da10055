#include <cerrno>

#include "drivers/ethercat/registers.h"
#include "tests/faults/kinds.h"

namespace faults {
namespace {

using namespace std::chrono_literals;
namespace reg = drivers::ethercat::reg;

/// A probability: some per cent, or nearly all.
double share(const Event& event) { return event.size < 0.5 ? 0.1 * event.size : event.size; }

template <double WireFaults::*Member>
Kind spoils(std::string_view name, std::string_view strikes = {}) {
  return {.name = name,
          .longest = 1500ms,
          .strikes = strikes,
          .begin = [](World& world, const Event& event) { world.wire.*Member = share(event); },
          .end = [](World& world, const Event& /*event*/) { world.wire.*Member = 0; }};
}

/// Each frame, for as long as it lasts.
template <double WireFaults::*Member>
Kind spoils_all(std::string_view name, std::string_view strikes) {
  return {.name = name,
          .longest = 1500ms,
          .last_torque_after = kLoss,
          .strikes = strikes,
          .begin = [](World& world, const Event& /*event*/) { world.wire.*Member = 1; },
          .end = [](World& world, const Event& /*event*/) { world.wire.*Member = 0; }};
}

template <int WireFaults::*Member, int Error>
Kind fails(std::string_view name) {
  return {.name = name,
          .longest = 2000ms,
          .last_torque_after = kLoss,
          .strikes = "interface",
          .begin = [](World& world, const Event& /*event*/) { world.wire.*Member = Error; },
          .end = [](World& world, const Event& /*event*/) { world.wire.*Member = 0; }};
}

/// By another master whose frames the daemon does not see. Over at once; the run has to end by `noticed`.
Kind writes(std::string_view name, Kind::Where where, std::chrono::milliseconds noticed,
            void (*write)(World& world, const Event& event)) {
  return {.name = name, .where = where, .last_torque_after = noticed, .begin = write};
}

/// `count` times `value` to the joint's slave, from `first` on.
void write_to_joint(World& world, const Event& event, std::uint16_t first, std::uint16_t value,
                    std::size_t count) {
  world.emulation().bus().write_as_another_master(world.emulation().position(event.place), first, value,
                                                  count);
}

std::uint16_t address_of_the_next(World& world, const Event& event) {
  sim::bus::EmulatedBus& bus = world.emulation().bus();
  return bus.slave((event.place + 1) % bus.size()).controller().get<std::uint16_t>(reg::kStationAddress);
}

std::vector<Kind> other_masters_writes() {
  return {
      writes("address-cleared-by-other-master", Kind::Where::kSlave, 150ms,
             [](World& world, const Event& event) {
               world.emulation().bus().write_as_another_master(event.place, reg::kStationAddress, 0);
             }),
      // A neighbour's, so that two answer to it, or an unused one.
      writes("address-changed-by-other-master", Kind::Where::kSlave, 150ms,
             [](World& world, const Event& event) {
               const std::uint16_t address =
                   event.size < 0.7 ? address_of_the_next(world, event) : std::uint16_t{0x7000};
               world.emulation().bus().write_as_another_master(event.place, reg::kStationAddress, address);
             }),
      // The outputs', the inputs' or both.
      writes("mapping-cleared-by-other-master", Kind::Where::kJoint, kLoss,
             [](World& world, const Event& event) {
               const bool inputs_alone = event.size < 0.3;
               write_to_joint(world, event,
                              static_cast<std::uint16_t>(reg::kFmmu + (inputs_alone ? reg::kFmmuBytes : 0)),
                              0, (event.size > 0.6 ? 2 : 1) * std::size_t{reg::kFmmuBytes} / 2);
             }),
      writes("watchdog-off-by-other-master", Kind::Where::kJoint, 300ms,
             [](World& world, const Event& event) {
               write_to_joint(world, event, reg::kWatchdogProcessData, 0, 1);
             }),
      // With which it expires at once.
      writes("watchdog-shortened-by-other-master", Kind::Where::kJoint, kLoss,
             [](World& world, const Event& event) {
               write_to_joint(world, event, reg::kWatchdogDivider, 0, 1);
             }),
      writes("sync-manager-off-by-other-master", Kind::Where::kJoint, kLoss,
             [](World& world, const Event& event) {
               const int manager = static_cast<int>(3.99 * event.size);
               write_to_joint(
                   world, event,
                   static_cast<std::uint16_t>(reg::kSyncManager + manager * reg::kSyncManagerBytes +
                                              reg::kSyncManagerActivate),
                   0, 1);
             }),
  };
}

}  // namespace

std::vector<Kind> wire_kinds() {
  std::vector<Kind> kinds{
      spoils<&WireFaults::loses_request>("requests-lost", "requests"),
      spoils<&WireFaults::loses_reply>("replies-lost", "replies"),
      spoils<&WireFaults::repeats>("replies-twice"),
      spoils<&WireFaults::damages>("replies-damaged"),
      spoils<&WireFaults::truncates>("replies-truncated", "truncation"),
      spoils<&WireFaults::miscounts>("replies-miscounted", "counters"),
      spoils<&WireFaults::holds_back>("replies-late"),
      spoils<&WireFaults::replays>("replies-from-before"),
      spoils<&WireFaults::adds_strangers>("strange-frames"),
      spoils_all<&WireFaults::loses_request>("all-requests-lost", "requests"),
      spoils_all<&WireFaults::loses_reply>("all-replies-lost", "replies"),
      spoils_all<&WireFaults::truncates>("all-replies-truncated", "truncation"),
      spoils_all<&WireFaults::miscounts>("all-replies-miscounted", "counters"),
      spoils<&WireFaults::adds_other_master>("other-master-asks"),
      {.name = "other-master-resets",
       .longest = 300ms,
       .begin = [](World& world,
                   const Event& event) { world.wire.resets_by_other_master = 0.02 + 0.3 * event.size; },
       .end = [](World& world, const Event&) { world.wire.resets_by_other_master = 0; }},
      fails<&WireFaults::send_error, ENETDOWN>("interface-down"),
      fails<&WireFaults::send_error, ENXIO>("interface-gone"),
      fails<&WireFaults::send_error, ENOBUFS>("send-queue-full"),
      fails<&WireFaults::receive_error, ENETDOWN>("receive-fails"),
      {.name = "frames-damaged-on-cable",
       .where = Kind::Where::kCable,
       .begin =
           [](World& world, const Event& event) {
             world.emulation().bus().damage(event.place, static_cast<std::uint32_t>(1 + 30 * event.size));
           }},
      {.name = "cable-out",
       .where = Kind::Where::kCable,
       .longest = 3000ms,
       .last_torque_after = kLoss,
       .strikes = "slaves",
       .begin = [](World& world,
                   const Event& event) { world.emulation().bus().set_cable(event.place, false); },
       .end = [](World& world, const Event& event) { world.emulation().bus().set_cable(event.place, true); }},
      {.name = "cable-loose",
       .where = Kind::Where::kCable,
       .longest = 1000ms,
       .strikes = "slaves",
       .begin =
           [](World& world, const Event& event) {
             world.emulation().bus().damage(event.place, 2);
             world.emulation().bus().set_cable(event.place, false);
             world.emulation().advance(std::chrono::microseconds(100));
             world.emulation().bus().set_cable(event.place, true);
           },
       .end = [](World& world, const Event& event) { world.emulation().bus().damage(event.place, 3); }},
      {.name = "slaves-taken-away-from-the-end",
       .longest = 3000ms,
       .last_torque_after = kLoss,
       .strikes = "slaves",
       .begin =
           [](World& world, const Event& /*event*/) {
             sim::bus::EmulatedBus& bus = world.emulation().bus();
             for (std::size_t slave = bus.size(); slave-- > 1;) {
               bus.set_power(slave, false);
               world.step();
             }
           },
       .end =
           [](World& world, const Event& /*event*/) {
             sim::bus::EmulatedBus& bus = world.emulation().bus();
             // Back in another order than they went.
             for (std::size_t slave = 1; slave < bus.size(); slave += 2) bus.set_power(slave, true);
             world.step();
             for (std::size_t slave = 2; slave < bus.size(); slave += 2) bus.set_power(slave, true);
           }},
  };
  const std::vector<Kind> writes = other_masters_writes();
  kinds.insert(kinds.end(), writes.begin(), writes.end());
  return kinds;
}

}  // namespace faults
