#include "sim/bus/slave_controller.h"

#include <algorithm>

#include "drivers/ethercat/registers.h"
#include "sim/bus/sii_image.h"

namespace sim::bus {
namespace {

namespace reg = drivers::ethercat::reg;
using std::chrono::nanoseconds;

constexpr std::uint8_t kEt1100 = 0x11;
constexpr std::uint8_t kPorts0And1AreMii = 0x0F;
constexpr std::uint16_t kClock64 = 0x000C;  // features: distributed clock, 64 bits wide

// Loop control of a port in DL control.
constexpr unsigned kAutoClose = 1;  // differs from "auto" only in how a returning link is reopened
constexpr unsigned kForcedOpen = 2;

unsigned loop_control(std::uint32_t dl_control, std::size_t port) noexcept {
  return dl_control >> (8 + 2 * port) & 3U;
}

}  // namespace

SlaveController::SlaveController(const SlaveDescription& description, SiiInterface::Timing sii,
                                 DistributedClock::Crystal crystal)
    : ram_kilobytes_(description.ram_kilobytes),
      has_clock_(description.has_distributed_clock),
      memory_(std::size_t{1024} * description.ram_kilobytes),
      managers_(description.sync_manager_count),
      fmmus_(description.fmmu_count),
      sii_(build_sii_image(description), sii, std::span(registers_).subspan<reg::kSiiConfiguration, 16>()),
      clock_(crystal) {
  reset({});
}

void SlaveController::reset(nanoseconds now) noexcept {
  now_ = now;
  registers_.fill(0);
  std::ranges::fill(memory_, std::uint8_t{0});
  for (std::size_t i = 0; i < managers_.size(); ++i) configure_manager(i);
  std::ranges::fill(fmmus_, Fmmu{});
  journal_writes_ = journal_used_ = 0;
  dl_status_read_ = al_status_read_ = watchdog_running_ = false;
  al_control_taken_ = true;
  sii_.reset();
  clock_.power_up(now);

  set<std::uint8_t>(reg::kType, kEt1100);
  set(reg::kFmmuCount, static_cast<std::uint8_t>(fmmus_.size()));
  set(reg::kSyncManagerCount, static_cast<std::uint8_t>(managers_.size()));
  set(reg::kRamKilobytes, ram_kilobytes_);
  set(reg::kPortDescriptor, kPorts0And1AreMii);
  set<std::uint16_t>(reg::kFeatures, has_clock_ ? kClock64 : 0);
  if (sii_.loaded()) {
    set(reg::kStationAlias, sii_.word(4));
    set(reg::kPdiControl, sii_.word(0));
  }
  // Register values after reset (section II).
  set<std::uint32_t>(reg::kDlControl, 0x0007'0001);
  set<std::uint16_t>(reg::kAlControl, 0x0001);
  set<std::uint16_t>(reg::kAlStatus, 0x0001);
  set<std::uint16_t>(reg::kWatchdogDivider, 2498);  // 100 us
  set<std::uint16_t>(reg::kWatchdogPdi, 1000);      // 100 ms
  set<std::uint16_t>(reg::kWatchdogProcessData, 1000);
  set<std::uint16_t>(reg::kWatchdogStatus, 0x0001);
  if (has_clock_) {
    set<std::uint16_t>(reg::kDcSpeedCounterStart, 0x1000);
    set<std::uint8_t>(reg::kDcSystemTimeFilter, 4);
    set<std::uint8_t>(reg::kDcSystemTimeFilter + 1, 12);
  }
  links_ = {};
  update_dl_status();
  set<std::uint16_t>(reg::kEventRequest, 0);
}

bool SlaveController::advance(nanoseconds now, nanoseconds step) noexcept {
  now_ = now;
  sii_.advance(step);
  if (!watchdog_running_) return false;
  const nanoseconds limit = nanoseconds(40) * (get<std::uint16_t>(reg::kWatchdogDivider) + 2) *
                            get<std::uint16_t>(reg::kWatchdogProcessData);
  since_outputs_ += step;
  if (limit.count() == 0 || since_outputs_ < limit) return false;
  watchdog_running_ = false;
  set<std::uint16_t>(reg::kWatchdogStatus, 0);
  increment(reg::kWatchdogCounters);
  return true;
}

std::uint32_t SlaveController::memory_end() const noexcept {
  return reg::kProcessMemory + static_cast<std::uint32_t>(memory_.size());
}

void SlaveController::increment(std::uint16_t address) noexcept {
  if (registers_[address] != 0xFF) ++registers_[address];  // error counters saturate there
}

// ---- ports ----

void SlaveController::set_link(std::size_t port, bool up) noexcept {
  if (links_[port] == up) return;
  links_[port] = up;
  if (!up && loop_control(get<std::uint32_t>(reg::kDlControl), port) <= kAutoClose) {
    increment(static_cast<std::uint16_t>(reg::kLostLinkCounters + port));
  }
  update_dl_status();
}

bool SlaveController::port_open(std::size_t port) const noexcept {
  const unsigned control = loop_control(get<std::uint32_t>(reg::kDlControl), port);
  return control <= kAutoClose ? links_[port] : control == kForcedOpen;
}

void SlaveController::update_dl_status() noexcept {
  // Bit 0: EEPROM loaded; 1: the firmware is alive; 4 + port: link; 8 + 2 port: loop closed; 9 + 2 port:
  // communication. Ports 2 and 3 do not exist: closed.
  unsigned status = (sii_.loaded() ? 0x0001U : 0U) | 0x0002U | 0x5000U;
  for (std::size_t port = 0; port < links_.size(); ++port) {
    if (links_[port]) status |= 0x0010U << port;
    if (!port_open(port)) status |= 0x0100U << (2 * port);
    if (port_open(port) && links_[port]) status |= 0x0200U << (2 * port);
  }
  if (status == get<std::uint16_t>(reg::kDlStatus)) return;
  set(reg::kDlStatus, static_cast<std::uint16_t>(status));
  registers_[reg::kEventRequest] |= reg::kDlStatusEvent;
}

void SlaveController::count_invalid_frame(std::size_t port, bool marked) noexcept {
  increment(static_cast<std::uint16_t>(marked ? reg::kForwardedErrorCounters + port
                                              : reg::kRxErrorCounters + 2 * port));
  if (port == 0) increment(reg::kProcessingErrorCounter);  // it continues to the processing unit
}

void SlaveController::count_processing_error() noexcept { increment(reg::kProcessingErrorCounter); }

// ---- firmware ----

std::uint16_t SlaveController::take_al_control() noexcept {
  al_control_taken_ = true;
  return get<std::uint16_t>(reg::kAlControl);
}

void SlaveController::set_al_status(std::uint16_t status, std::uint16_t code) noexcept {
  if (status == get<std::uint16_t>(reg::kAlStatus) && code == get<std::uint16_t>(reg::kAlStatusCode)) return;
  set(reg::kAlStatus, status);
  set(reg::kAlStatusCode, code);
  registers_[reg::kEventRequest] |= reg::kAlStatusEvent;
}

std::span<const std::uint8_t> SlaveController::manager_registers() const noexcept {
  return std::span(registers_).subspan(reg::kSyncManager, managers_.size() * reg::kSyncManagerBytes);
}

void SlaveController::configure_manager(std::size_t index) noexcept {
  const std::size_t own = reg::kSyncManager + index * reg::kSyncManagerBytes;
  managers_[index].configure(std::span(registers_).subspan(own, reg::kSyncManagerBytes), memory_);
}

void SlaveController::set_deactivated(std::size_t manager, bool deactivated) noexcept {
  std::uint8_t& pdi = registers_[reg::kSyncManager + manager * reg::kSyncManagerBytes + reg::kSyncManagerPdi];
  pdi = static_cast<std::uint8_t>(deactivated ? pdi | 0x01 : pdi & ~0x01);
  configure_manager(manager);
}

bool SlaveController::repeat_requested(std::size_t manager) const noexcept {
  const std::uint8_t* const own = &registers_[reg::kSyncManager + manager * reg::kSyncManagerBytes];
  return ((own[reg::kSyncManagerActivate] ^ own[reg::kSyncManagerPdi]) & reg::kRepeatRequest) != 0;
}

void SlaveController::acknowledge_repeat(std::size_t manager) noexcept {
  registers_[reg::kSyncManager + manager * reg::kSyncManagerBytes + reg::kSyncManagerPdi] ^=
      reg::kRepeatAcknowledge;
}

}  // namespace sim::bus
