// Execution of datagrams by a slave controller; the rest is in slave_controller.cpp.
#include <algorithm>
#include <utility>

#include "drivers/ethercat/registers.h"
#include "sim/bus/slave_controller.h"

namespace sim::bus {
namespace {

namespace reg = drivers::ethercat::reg;
using drivers::ethercat::Datagram;
using drivers::ethercat::kMaxDatagramBytes;
using drivers::ethercat::load_le;
using drivers::ethercat::store_le;

constexpr std::uint32_t kAliasEnabled = 0x0100'0000;  // in DL control

enum class Target : std::uint8_t { kNone, kPosition, kStation, kAll, kImage };

constexpr SlaveController::Access kRead{.reads = true, .writes = false};
constexpr SlaveController::Access kWrite{.reads = false, .writes = true};
constexpr SlaveController::Access kExchange{.reads = true, .writes = true};

struct Rule {
  Target target = Target::kNone;
  SlaveController::Access access{};
  bool others_write = false;  // the addressed one reads
};
// Index: number of the command (ETG.1000.4, table 6).
constexpr std::array<Rule, drivers::ethercat::kHighestCommand + 1> kRules{{
    {},
    {Target::kPosition, kRead},
    {Target::kPosition, kWrite},
    {Target::kPosition, kExchange},
    {Target::kStation, kRead},
    {Target::kStation, kWrite},
    {Target::kStation, kExchange},
    {Target::kAll, kRead},
    {Target::kAll, kWrite},
    {Target::kAll, kExchange},
    {Target::kImage, kRead},
    {Target::kImage, kWrite},
    {Target::kImage, kExchange},
    {.target = Target::kPosition, .others_write = true},  // ARMW
    {.target = Target::kStation, .others_write = true},   // FRMW
}};

using DatagramBytes = std::array<std::uint8_t, kMaxDatagramBytes + 2>;

// Whether an access to `address`, `length` bytes long, touches any of `count` registers from `first`.
constexpr bool touches(std::size_t address, std::size_t length, std::size_t first,
                       std::size_t count) noexcept {
  return address < first + count && first < address + length;
}

}  // namespace

void SlaveController::begin_frame(const FrameTimes& times) noexcept {
  times_ = times;
  journal_writes_ = journal_used_ = 0;
  dl_status_read_ = al_status_read_ = false;
  update_manager_status();
}

// Only frames read it, so it is updated at their beginning: nothing that changes it takes effect before their
// end.
void SlaveController::update_manager_status() noexcept {
  unsigned events = get<std::uint16_t>(reg::kEventRequest) & (reg::kDlStatusEvent | reg::kAlStatusEvent);
  for (std::size_t i = 0; i < managers_.size(); ++i) {
    const std::uint8_t status = managers_[i].guarding() ? managers_[i].status() : std::uint8_t{0x30};
    registers_[reg::kSyncManager + i * reg::kSyncManagerBytes + reg::kSyncManagerStatus] = status;
    if (i < 8 && (status & 0x03) != 0) events |= 0x10U << i;
  }
  set(reg::kEventRequest, static_cast<std::uint16_t>(events));
}

void SlaveController::process(Datagram& datagram) noexcept {
  const auto events = static_cast<std::uint16_t>(get<std::uint16_t>(reg::kEventRequest) &
                                                 get<std::uint16_t>(reg::kEventMask));
  datagram.interrupt |= events;
  store_le(datagram.header + 8, datagram.interrupt);

  const auto command = static_cast<std::size_t>(datagram.command);
  const Rule rule = command < kRules.size() ? kRules[command] : Rule{};
  bool addressed = false;
  switch (rule.target) {
    case Target::kNone: return;
    case Target::kPosition:
    case Target::kAll: {  // every slave increments it; zero on arrival means this one
      addressed = rule.target == Target::kAll || datagram.slave() == 0;
      const auto next = static_cast<std::uint16_t>(datagram.slave() + 1);
      datagram.address = (datagram.address & 0xFFFF'0000U) | next;
      store_le(datagram.header + 2, next);
      break;
    }
    case Target::kStation:
      addressed = datagram.slave() == get<std::uint16_t>(reg::kStationAddress) ||
                  ((get<std::uint32_t>(reg::kDlControl) & kAliasEnabled) != 0 &&
                   datagram.slave() == get<std::uint16_t>(reg::kStationAlias));
      break;
    case Target::kImage: break;
  }

  unsigned counted = 0;
  if (rule.target == Target::kImage) {
    counted = logical(datagram.address, datagram.data, rule.access);
  } else if (rule.others_write) {
    counted = physical(datagram.offset(), datagram.data, addressed ? kRead : kWrite, false);
  } else if (addressed) {
    counted = physical(datagram.offset(), datagram.data, rule.access, rule.target == Target::kAll);
  }
  store_le(datagram.counter, static_cast<std::uint16_t>(datagram.working_counter() + counted));
}

// A read counts 1; a write counts 1, or 2 if the command also reads (section I, table 5).
unsigned SlaveController::physical(std::uint16_t address, std::span<std::uint8_t> data, Access access,
                                   bool broadcast) noexcept {
  DatagramBytes incoming;  // the received data are written, whatever is read meanwhile
  const bool both = access.reads && access.writes;
  if (both || (broadcast && access.reads)) std::ranges::copy(data, incoming.begin());
  unsigned counted = 0;
  if (access.reads) {
    if (broadcast) std::ranges::fill(data, std::uint8_t{0});
    if (read(address, data)) counted += 1;
    if (broadcast) {
      for (std::size_t i = 0; i < data.size(); ++i) data[i] |= incoming[i];
    }
  }
  if (access.writes) {
    const std::span<const std::uint8_t> source = both ? std::span(incoming).first(data.size()) : data;
    if (write(address, source)) counted += access.reads ? 2 : 1;
  }
  return counted;
}

unsigned SlaveController::logical(std::uint32_t address, std::span<std::uint8_t> data,
                                  Access access) noexcept {
  DatagramBytes incoming;
  DatagramBytes own;
  bool any_read = false;
  bool any_write = false;
  bool kept = false;
  // In reverse order, so that the first one wins where two read the same bit.
  for (auto fmmu = fmmus_.rbegin(); access.reads && fmmu != fmmus_.rend(); ++fmmu) {
    const MappedBits bits = fmmu->reads() ? fmmu->match(address, data.size()) : MappedBits{};
    if (bits.count == 0) continue;
    if (access.writes && !std::exchange(kept, true)) std::copy(data.begin(), data.end(), incoming.begin());
    if (bits.whole_bytes()) {
      any_read |= read(bits.physical_byte(), data.subspan(bits.first / 8, bits.count / 8));
    } else if (read(bits.physical_byte(), std::span(own).first(bits.physical_bytes()))) {
      copy_bits_to_datagram(bits, own, data);
      any_read = true;
    }
  }
  const std::span<const std::uint8_t> source =
      kept ? std::span<const std::uint8_t>(incoming).first(data.size()) : data;
  for (auto fmmu = fmmus_.begin(); access.writes && fmmu != fmmus_.end(); ++fmmu) {
    const MappedBits bits = fmmu->writes() ? fmmu->match(address, data.size()) : MappedBits{};
    if (bits.count == 0) continue;
    if (bits.whole_bytes()) {
      any_write |= write(bits.physical_byte(), source.subspan(bits.first / 8, bits.count / 8));
    } else {
      const std::span<std::uint8_t> target = std::span(own).first(bits.physical_bytes());
      copy_bits_from_datagram(bits, source, target);
      any_write |= write(bits.physical_byte(), target);
    }
  }
  return (any_read ? 1U : 0U) + (any_write ? (access.reads ? 2U : 1U) : 0U);
}

// Number of `bytes` from `address` on that are handled alike: by `guard`, or as plain memory if it is null.
std::size_t SlaveController::bytes_alike(std::uint32_t address, std::size_t bytes,
                                         SyncManager*& guard) noexcept {
  guard = nullptr;
  std::size_t count = std::min<std::size_t>(bytes, memory_end() - address);
  for (SyncManager& manager : managers_) {
    if (manager.guards(address)) {
      guard = &manager;
      return std::min<std::size_t>(bytes, manager.end() - address);
    }
    if (manager.guarding() && manager.start() > address) {
      count = std::min<std::size_t>(count, manager.start() - address);
    }
  }
  return count;
}

// True if any byte was read; the others keep the datagram's content. Without a configuration from its EEPROM
// a controller provides no process memory (section I, 11.2.1).
bool SlaveController::read(std::uint32_t address, std::span<std::uint8_t> data) noexcept {
  bool any = false;
  while (!data.empty()) {
    std::size_t count = 0;
    if (address < kRegisterBytes) {
      count = std::min<std::size_t>(data.size(), kRegisterBytes - address);
      read_registers(address, data.first(count));
      any = true;
    } else if (address < memory_end() && sii_.loaded()) {
      SyncManager* guard = nullptr;
      count = bytes_alike(address, data.size(), guard);
      if (guard != nullptr) {
        any |= guard->master_read(address, data.first(count));
      } else {
        std::copy_n(&memory_[address - reg::kProcessMemory], count, data.begin());
        any = true;
      }
    } else {
      break;
    }
    address += static_cast<std::uint32_t>(count);
    data = data.subspan(count);
  }
  return any;
}

bool SlaveController::write(std::uint32_t address, std::span<const std::uint8_t> data) noexcept {
  bool any = false;
  while (!data.empty()) {
    std::size_t count = 0;
    if (address < kRegisterBytes) {
      // User memory has no shadow buffer and is handled separately.
      const std::size_t end = address < kUserMemory ? kUserMemory : kRegisterBytes;
      count = std::min<std::size_t>(data.size(), end - address);
      any |= write_registers(address, data.first(count));
    } else if (address < memory_end() && sii_.loaded()) {
      SyncManager* guard = nullptr;
      count = bytes_alike(address, data.size(), guard);
      if (guard != nullptr) {
        any |= guard->master_write(address, data.first(count));
      } else {
        std::copy_n(data.begin(), count, &memory_[address - reg::kProcessMemory]);
        any = true;
      }
    } else {
      break;
    }
    address += static_cast<std::uint32_t>(count);
    data = data.subspan(count);
  }
  return any;
}

void SlaveController::read_registers(std::uint32_t address, std::span<std::uint8_t> data) noexcept {
  const bool wants_time = touches(address, data.size(), reg::kDcSystemTime, 8);
  if (has_clock_ && wants_time) set(reg::kDcSystemTime, system_time());
  if (touches(address, data.size(), reg::kDlStatus, 2)) dl_status_read_ = true;
  if (touches(address, data.size(), reg::kAlStatus, 2)) al_status_read_ = true;
  std::copy_n(&registers_[address], data.size(), data.begin());
}

bool SlaveController::write_registers(std::uint32_t address, std::span<const std::uint8_t> data) noexcept {
  if (address >= kUserMemory) {
    std::ranges::copy(data, &registers_[address]);
    return true;
  }
  // More than a frame can hold, which needs several FMMUs that map the same bytes to registers.
  if (journal_writes_ == journal_.size() || journal_used_ + data.size() > journal_bytes_.size()) return false;
  journal_[journal_writes_++] = {.address = static_cast<std::uint16_t>(address),
                                 .length = static_cast<std::uint16_t>(data.size())};
  std::ranges::copy(data, &journal_bytes_[journal_used_]);
  journal_used_ += data.size();
  return true;
}

// ---- the end of a frame ----

FrameEvents SlaveController::end_frame(bool good) noexcept {
  FrameEvents events;
  for (std::size_t i = 0; i < managers_.size(); ++i) {
    switch (managers_[i].end_frame(good)) {
      case SyncManager::Event::kNone: break;
      case SyncManager::Event::kRead: events.read |= 1U << i; break;
      case SyncManager::Event::kWritten:
        events.written |= 1U << i;
        if (managers_[i].triggers_watchdog()) {
          watchdog_running_ = true;
          since_outputs_ = {};
          set<std::uint16_t>(reg::kWatchdogStatus, 1);
        }
        break;
    }
  }
  if (good) {
    // Reading a status clears its event (section II, 0x0210).
    if (dl_status_read_)
      registers_[reg::kEventRequest] &= static_cast<std::uint8_t>(~unsigned{reg::kDlStatusEvent});
    if (al_status_read_)
      registers_[reg::kEventRequest] &= static_cast<std::uint8_t>(~unsigned{reg::kAlStatusEvent});
    std::span<const std::uint8_t> bytes(journal_bytes_);
    for (const RegisterWrite& write : std::span(journal_).first(journal_writes_)) {
      commit(write.address, bytes.first(write.length), events);
      bytes = bytes.subspan(write.length);
    }
  }
  journal_writes_ = journal_used_ = 0;
  return events;
}

void SlaveController::commit(std::uint16_t address, std::span<const std::uint8_t> data,
                             FrameEvents& events) noexcept {
  const std::size_t length = data.size();
  const std::size_t fmmus_end = reg::kFmmu + fmmus_.size() * reg::kFmmuBytes;
  for (std::size_t i = 0; i < length; ++i) {
    const std::size_t at = address + i;
    if (at >= fmmus_end && at < reg::kSyncManager) continue;                      // missing FMMUs
    if (!has_clock_ && at >= reg::kDcReceiveTimes && at < kUserMemory) continue;  // and a missing clock
    if (at / 2 == reg::kAlControl / 2 && !al_control_taken_) continue;
    const std::uint8_t mask = kWritableBits[at];
    registers_[at] = static_cast<std::uint8_t>((registers_[at] & ~mask) | (data[i] & mask));
  }
  if (touches(address, length, reg::kDlControl, 4)) update_dl_status();
  if (touches(address, length, reg::kAlControl, 2)) {
    events.al_control = std::exchange(al_control_taken_, false) || events.al_control;
  }
  clear_counters(address, length);
  if (touches(address, length, reg::kSiiConfiguration, 16)) {
    const std::size_t skipped = reg::kSiiConfiguration > address ? reg::kSiiConfiguration - address : 0U;
    sii_.write(address + skipped - reg::kSiiConfiguration, data.subspan(skipped));
    update_dl_status();  // a reload may have changed it
  }
  for (std::size_t i = 0; i < fmmus_.size(); ++i) {
    const std::size_t own = reg::kFmmu + i * reg::kFmmuBytes;
    if (touches(address, length, own, reg::kFmmuBytes)) {
      fmmus_[i].configure(std::span(registers_).subspan(own, reg::kFmmuBytes));
    }
  }
  if (touches(address, length, reg::kSyncManager, managers_.size() * reg::kSyncManagerBytes)) {
    commit_managers(address, data, events);
  }
  if (has_clock_ && touches(address, length, reg::kDcReceiveTimes, 0x40)) commit_clock(address, data);
}

void SlaveController::commit_managers(std::uint16_t address, std::span<const std::uint8_t> data,
                                      FrameEvents& events) noexcept {
  for (std::size_t i = 0; i < managers_.size(); ++i) {
    const std::size_t own = reg::kSyncManager + i * reg::kSyncManagerBytes;
    if (!touches(address, data.size(), own, reg::kSyncManagerBytes)) continue;
    const bool enabled = (registers_[own + reg::kSyncManagerActivate] & 0x01) != 0;
    for (std::size_t at = own; at < own + reg::kSyncManagerBytes; ++at) {
      if (at < address || at >= address + data.size()) continue;
      const std::uint8_t byte = data[at - address];
      // Start, length and control are locked while enabled (section II, table 89); the master cannot write
      // status and the firmware's register.
      if (at - own < reg::kSyncManagerStatus && !enabled) registers_[at] = byte;
      if (at - own == reg::kSyncManagerActivate) registers_[at] = byte & 0xC3;
    }
    configure_manager(i);
    events.managers_changed = true;
  }
}

void SlaveController::clear_counters(std::uint16_t address, std::size_t length) noexcept {
  // A write to any register of a group clears the group (section II, 0x0300 to 0x0313, 0x0442).
  struct Group {
    std::size_t first;
    std::size_t count;
  };
  constexpr std::array<Group, 5> kGroups{{{reg::kRxErrorCounters, 12},
                                          {reg::kProcessingErrorCounter, 1},
                                          {reg::kPdiErrorCounter, 2},
                                          {reg::kLostLinkCounters, 4},
                                          {reg::kWatchdogCounters, 2}}};
  for (const Group& group : kGroups) {
    if (touches(address, length, group.first, group.count)) {
      std::fill_n(&registers_[group.first], group.count, std::uint8_t{0});
    }
  }
}

// Local copy of the system time when the frame passed the reference clock (section II, table 100). Unsigned,
// because any offset from the master may wrap it.
std::uint64_t SlaveController::system_time() const noexcept {
  return static_cast<std::uint64_t>(clock_.local_ns(times_.port0)) +
         get<std::uint64_t>(reg::kDcSystemTimeOffset) - get<std::uint32_t>(reg::kDcSystemTimeDelay);
}

void SlaveController::commit_clock(std::uint16_t address, std::span<const std::uint8_t> data) noexcept {
  if (touches(address, data.size(), reg::kDcReceiveTimes, 4)) {  // latches the times of this frame
    const std::int64_t port0 = clock_.local_ns(times_.port0);
    set(reg::kDcReceiveTimes, static_cast<std::uint32_t>(port0));
    if (times_.through_port1) {
      set<std::uint32_t>(reg::kDcReceiveTimes + 4, static_cast<std::uint32_t>(clock_.local_ns(times_.port1)));
    }
    set(reg::kDcReceiveTimeUnit, port0);
  }
  if (touches(address, data.size(), reg::kDcSpeedCounterStart, 2)) clock_.reset_filters(now_);
  if (touches(address, data.size(), reg::kDcSystemTime, 1)) {
    // The lower half is compared with the local copy at the beginning of the frame (section II, table 100).
    const auto skipped = static_cast<std::size_t>(reg::kDcSystemTime - std::min(address, reg::kDcSystemTime));
    std::array<std::uint8_t, 4> received{};
    std::ranges::copy(data.subspan(skipped).first(std::min<std::size_t>(4, data.size() - skipped)),
                      received.begin());
    const std::uint32_t error =
        static_cast<std::uint32_t>(system_time()) - load_le<std::uint32_t>(received.data());
    clock_.steer(times_.port0, static_cast<std::int32_t>(error), get<std::uint8_t>(reg::kDcSystemTimeFilter));
  }
  set(reg::kDcSystemTimeDifference, clock_.difference());
  set(reg::kDcSpeedCounterDifference, clock_.speed_difference(get<std::uint16_t>(reg::kDcSpeedCounterStart)));
}

}  // namespace sim::bus
