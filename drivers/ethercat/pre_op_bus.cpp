#include "drivers/ethercat/pre_op_bus.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <utility>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/registers.h"

namespace drivers::ethercat {
namespace {

/// Clocks that differ by 100 ppm synchronise within some thousand corrections.
constexpr int kSettlingFrames = 3000;
/// The youBot's controllers do not tolerate process data much faster.
constexpr auto kStartPeriod = std::chrono::milliseconds(1);

}  // namespace

PreOpBus::PreOpBus(Link& link, FrameTap* tap, const Options& options)
    : transceiver_(std::make_unique<Transceiver>(link, tap)),
      options_(options),
      access_(*transceiver_, options.access),
      slaves_(scan_bus(access_, link.name())) {
  for (const Slave& slave : slaves_) mailboxes_.emplace_back(slave);
}

void PreOpBus::broadcast_write(std::uint16_t address, std::span<const std::uint8_t> data) {
  const std::uint16_t taken = access_.broadcast_write(address, data);
  if (taken != slaves_.size())
    throw BusError(transceiver_->link().name(), "write a register of all slaves",
                   std::to_string(taken) + " of " + std::to_string(slaves_.size()) + " took it");
}

void PreOpBus::enter_pre_op() {
  // Clears what a previous master left: outputs off first, then its mappings.
  (void)access_.broadcast_write(
      reg::kAlControl,
      std::array<std::uint8_t, 2>{static_cast<std::uint8_t>(AlState::kInit) | reg::kAlError, 0});
  const std::array<std::uint8_t, 16 * reg::kFmmuBytes> no_fmmus{};
  const std::array<std::uint8_t, 8 * reg::kSyncManagerBytes> no_sync_managers{};
  (void)access_.broadcast_write(reg::kFmmu, no_fmmus);
  (void)access_.broadcast_write(reg::kSyncManager, no_sync_managers);
  const std::array<std::uint8_t, 20> no_errors{};
  (void)access_.broadcast_write(reg::kRxErrorCounters, no_errors);

  std::vector<std::vector<SetupStep>> steps;
  std::vector<SlaveSetup> setups(slaves_.size());
  for (const Slave& slave : slaves_) steps.push_back(steps_to_pre_op(slave));
  for (std::size_t i = 0; i < setups.size(); ++i)
    setups[i].begin(slaves_[i].station, steps[i], options_.state_timeout);
  run_setups(setups);
}

void PreOpBus::run_setups(std::vector<SlaveSetup>& setups) {
  const auto running = [&](std::size_t i) { return setups[i].status() == SlaveSetup::Status::kRunning; };
  const auto any_running = [&] {
    for (std::size_t i = 0; i < setups.size(); ++i)
      if (running(i)) return true;
    return false;
  };
  while (any_running()) {
    access_.each(
        setups.size(), [&](std::size_t i) { return !running(i); },
        [&](FrameWriter& writer, std::uint8_t index, std::size_t i) {
          if (setups[i].request(writer, index, now())) return true;
          // Just timed out: a placeholder keeps datagrams and slaves aligned.
          return !running(i) && writer.add(Command::kNop, index, 0, 0).counter != nullptr;
        },
        [&](const Datagram& datagram, std::size_t i) { setups[i].answer(datagram, now()); });
  }
  for (std::size_t i = 0; i < setups.size(); ++i)
    if (setups[i].status() == SlaveSetup::Status::kFailed)
      throw BusError(slaves_[i].label(), "change state", setups[i].failure());
}

std::span<const std::uint8_t> PreOpBus::mailbox_exchange(std::size_t i,
                                                         std::span<const std::uint8_t> request) {
  MailboxLine& line = mailboxes_[i];
  line.clear();
  const bool begun =
      request.empty() ? line.listen(options_.mailbox_timeout) : line.post(request, options_.mailbox_timeout);
  if (!begun)
    throw BusError(slaves_[i].label(), "use its mailbox",
                   line.exists() ? "the request is longer than the mailbox" : "it has none");
  while (line.status() == MailboxLine::Status::kBusy) {
    FrameWriter& writer = transceiver_->begin();
    if (!line.add(writer, transceiver_->index(), now())) continue;
    const bool answered = transceiver_->exchange(options_.access.frame_timeout);
    access_.require_no_other_master();
    if (!answered) {
      line.frame_lost();
      continue;
    }
    FrameReader answer = transceiver_->answer();
    Datagram datagram;
    if (answer.next(datagram)) line.answer(datagram);
  }
  if (line.status() != MailboxLine::Status::kReplied)
    throw BusError(slaves_[i].label(), "wait for its mailbox", "no reply in time");
  return line.reply();
}

OpBus PreOpBus::start(std::size_t driven) && {
  Link& link = transceiver_->link();
  std::optional<DistributedClocks> clocks;
  if (options_.distributed_clocks) {
    // Any epoch will do for the slaves' time; our clock makes it comparable.
    clocks.emplace(access_, slaves_, static_cast<std::uint64_t>(link.now().count()));
    clocks->settle(access_, kSettlingFrames);
  }
  options_.cyclic.bystanders = slaves_.size() - driven;
  slaves_.resize(driven);
  std::vector<std::vector<SetupStep>> steps;
  std::vector<SlaveSetup> setups(slaves_.size());
  for (const Slave& slave : slaves_) steps.push_back(steps_to_safe_op(slave));
  for (std::size_t i = 0; i < setups.size(); ++i)
    setups[i].begin(slaves_[i].station, steps[i], options_.state_timeout);
  run_setups(setups);

  OpBus bus(std::move(transceiver_), std::move(slaves_), options_.cyclic, std::move(clocks));
  // Some slaves enter OP only while they receive outputs: the cycle starts at once.
  const std::chrono::nanoseconds begin = link.now();
  const std::chrono::nanoseconds deadline = begin + options_.state_timeout;
  const auto fail = [&bus](const std::string& who, const char* step, const std::string& why) {
    bus.leave_op();
    throw BusError(who, step, why);
  };
  while (!bus.exchange(link.now()).all_operational) {
    if (bus.other_master_present())
      throw BusError(link.name(), "start the cycle", bus.other_master().describe());
    link.wait(kStartPeriod);
    const bool late = link.now() > deadline;
    for (std::size_t i = 0; i < bus.size(); ++i) {
      const SlaveHealth& health = bus.health(i);
      if (const std::string failure = bus.failure(i); !failure.empty())
        fail(bus.slave(i).label(), "change state", failure);
      // It answers again after lost or late frames, or its watchdog ended OP between two frames.
      if (health.condition == SlaveCondition::kStopped) bus.resume(i);
      if (!late || health.condition == SlaveCondition::kOperational) continue;
      char text[200];
      std::snprintf(
          text, sizeof text,
          "OP not reached: it is in %s%s, AL status code (register 0x0134) 0x%04X %s, after %lld ms",
          to_string(health.state), health.al_error ? " with error" : "", health.al_code,
          describe_al_status_code(health.al_code),
          static_cast<long long>(
              std::chrono::duration_cast<std::chrono::milliseconds>(link.now() - begin).count()));
      fail(bus.slave(i).label(), "change state", text);
    }
    if (late)
      fail("the bus", "start the cycle",
           "all slaves are in OP, but the working counter stays short of what was mapped");
  }
  return bus;
}

}  // namespace drivers::ethercat
