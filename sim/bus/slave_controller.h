/// @file
/// An EtherCAT slave controller: the chip between the bus and a board's firmware (ETG.1000.4, Beckhoff ESC
/// data sheet sections I and II).
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "sim/bus/distributed_clock.h"
#include "sim/bus/fmmu.h"
#include "sim/bus/register_map.h"
#include "sim/bus/sii_interface.h"
#include "sim/bus/slave_description.h"
#include "sim/bus/sync_manager.h"

namespace sim::bus {

/// Emulated times at which a frame reached the ports of a slave.
struct FrameTimes {
  std::chrono::nanoseconds port0{};
  std::chrono::nanoseconds port1{};
  bool through_port1 = false;  ///< false: the frame was returned in this slave
};

/// Effects of a frame that the firmware needs to know.
struct FrameEvents {
  std::uint32_t written = 0;  ///< bit n: sync manager n was completely written by the master
  std::uint32_t read = 0;     ///< ... read
  bool al_control = false;    ///< AL control was written
  bool managers_changed = false;
};

/// Registers 0x0000 to 0x0FFF, process memory from 0x1000, addressing, working counters, FMMUs, sync
/// managers, EEPROM, process data watchdog, error counters, ports 0 and 1, distributed clock.
///
/// Writes to registers and exchanges of sync-manager buffers take effect at the end of the frame, and only if
/// the frame is good; memory is written while the frame passes (section I, "shadow buffer"). A write to a
/// read-only or reserved register changes nothing but counts as done: the memory is accessible, which is all
/// that the working counter states (section I, 2.4). Not emulated: write protection, ESC reset, MII
/// management, device emulation, SYNC and latch signals, forwarding of other protocols.
class SlaveController {
 public:
  /// Effect of a datagram on memory, from the master's point of view.
  struct Access {
    bool reads = false;
    bool writes = false;
  };

  SlaveController(const SlaveDescription& description, SiiInterface::Timing sii,
                  DistributedClock::Crystal crystal);
  SlaveController(const SlaveController&) = delete;
  SlaveController& operator=(const SlaveController&) = delete;

  /// Power-up at emulated time `now`: registers and memory cleared, EEPROM kept.
  void reset(std::chrono::nanoseconds now) noexcept;
  /// True: the process data watchdog has just expired.
  bool advance(std::chrono::nanoseconds now, std::chrono::nanoseconds step) noexcept;

  // ---- frames ----

  void begin_frame(const FrameTimes& times) noexcept;
  /// Executes the datagram in place: data, address, working counter, interrupt bits.
  void process(drivers::ethercat::Datagram& datagram) noexcept;
  /// A damaged frame leaves registers and buffers unchanged.
  FrameEvents end_frame(bool good) noexcept;

  // ---- ports ----

  void set_link(std::size_t port, bool up) noexcept;  ///< a link that goes down is counted
  bool link(std::size_t port) const noexcept { return links_[port]; }
  /// Whether frames leave by this port, from its link and DL control. A port forced open without a link loses
  /// them.
  bool port_open(std::size_t port) const noexcept;
  /// An invalid frame arrived at this port; `marked`: a slave before it has already noticed.
  void count_invalid_frame(std::size_t port, bool marked) noexcept;
  void count_processing_error() noexcept;

  // ---- firmware ----

  template <typename T>
  T get(std::uint16_t address) const noexcept {
    return drivers::ethercat::load_le<T>(&registers_[address]);
  }
  /// The state requested by the master; it may write AL control again from now on (section II, 0x0120).
  std::uint16_t take_al_control() noexcept;
  /// AL status and its code; raises the master's event if it differs.
  void set_al_status(std::uint16_t status, std::uint16_t code) noexcept;
  /// Blocks all access to a sync manager (section I, 8.7), or unblocks it.
  void set_deactivated(std::size_t manager, bool deactivated) noexcept;
  void acknowledge_repeat(std::size_t manager) noexcept;
  bool repeat_requested(std::size_t manager) const noexcept;
  SyncManager& manager(std::size_t index) noexcept { return managers_[index]; }
  std::span<const std::uint8_t> manager_registers() const noexcept;
  std::span<const Fmmu> fmmus() const noexcept { return fmmus_; }
  std::uint32_t memory_end() const noexcept;

  SiiInterface& sii() noexcept { return sii_; }
  const DistributedClock& clock() const noexcept { return clock_; }

 private:
  struct RegisterWrite {
    std::uint16_t address = 0;
    std::uint16_t length = 0;
  };
  template <typename T>
  void set(std::uint16_t address, T value) noexcept {
    drivers::ethercat::store_le(&registers_[address], value);
  }
  void increment(std::uint16_t address) noexcept;
  void update_dl_status() noexcept;
  void update_manager_status() noexcept;

  unsigned physical(std::uint16_t address, std::span<std::uint8_t> data, Access access,
                    bool broadcast) noexcept;
  unsigned logical(std::uint32_t address, std::span<std::uint8_t> data, Access access) noexcept;
  bool read(std::uint32_t address, std::span<std::uint8_t> data) noexcept;
  bool write(std::uint32_t address, std::span<const std::uint8_t> data) noexcept;
  void read_registers(std::uint32_t address, std::span<std::uint8_t> data) noexcept;
  bool write_registers(std::uint32_t address, std::span<const std::uint8_t> data) noexcept;
  std::size_t bytes_alike(std::uint32_t address, std::size_t bytes, SyncManager*& guard) noexcept;

  void commit(std::uint16_t address, std::span<const std::uint8_t> data, FrameEvents& events) noexcept;
  void commit_managers(std::uint16_t address, std::span<const std::uint8_t> data,
                       FrameEvents& events) noexcept;
  void commit_clock(std::uint16_t address, std::span<const std::uint8_t> data) noexcept;
  void clear_counters(std::uint16_t address, std::size_t length) noexcept;
  void configure_manager(std::size_t index) noexcept;
  std::uint64_t system_time() const noexcept;

  const std::uint8_t ram_kilobytes_;
  const bool has_clock_;
  std::array<std::uint8_t, kRegisterBytes> registers_{};
  std::vector<std::uint8_t> memory_;
  std::vector<SyncManager> managers_;
  std::vector<Fmmu> fmmus_;
  SiiInterface sii_;
  DistributedClock clock_;
  std::array<bool, 2> links_{};

  std::chrono::nanoseconds now_{};
  FrameTimes times_{};
  // Registers written in this frame, in order; their bytes are concatenated.
  std::array<RegisterWrite, 256> journal_{};
  std::array<std::uint8_t, 2048> journal_bytes_{};
  std::size_t journal_writes_ = 0;
  std::size_t journal_used_ = 0;
  bool al_control_taken_ = true;  // by the firmware
  bool dl_status_read_ = false;   // in this frame
  bool al_status_read_ = false;

  bool watchdog_running_ = false;
  std::chrono::nanoseconds since_outputs_{};
};

}  // namespace sim::bus
