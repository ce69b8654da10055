/// @file
/// A sync manager: guards an area of process memory shared by master and firmware (ESC data sheet section I,
/// chapter 8; ETG.1000.4 section 6.7).
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

namespace sim::bus {

/// Mailbox mode: one buffer, written and read alternately. Buffered mode: three buffers of which the first is
/// addressed; the reader always gets the newest complete one. An access starts with the first byte of the
/// area and is complete with the last one; it may be spread over datagrams. A complete access takes effect at
/// the end of the frame, if the frame is good.
class SyncManager {
 public:
  enum class Event : std::uint8_t { kNone, kWritten, kRead };

  /// Applies its eight registers; enabling or disabling empties it. `memory` is the process memory from
  /// 0x1000: an area that leaves it is not guarded.
  void configure(std::span<const std::uint8_t> registers, std::span<std::uint8_t> memory) noexcept;

  /// Whether this sync manager handles an access of the master to `address`: hidden buffers included.
  bool guards(std::uint32_t address) const noexcept {
    return guarding_ && address >= start_ && address < end_;
  }
  std::uint32_t start() const noexcept { return start_; }
  std::uint32_t end() const noexcept { return end_; }  ///< behind the last guarded byte
  bool guarding() const noexcept { return guarding_; }
  bool triggers_watchdog() const noexcept { return (control_ & kWatchdogTrigger) != 0; }
  bool full() const noexcept { return full_; }
  /// Register +5.
  std::uint8_t status() const noexcept;

  // The master's side. False: refused, no byte transferred and the working counter unchanged.
  bool master_write(std::uint32_t address, std::span<const std::uint8_t> bytes) noexcept;
  bool master_read(std::uint32_t address, std::span<std::uint8_t> bytes) noexcept;
  /// Accesses completed by this frame; a damaged frame completes nothing.
  Event end_frame(bool good) noexcept;

  // The firmware's side.
  /// The mailbox's content or the newest complete outputs; empty if there is none.
  std::span<const std::uint8_t> firmware_read() noexcept;
  /// Mailbox: may be written again.
  void firmware_release() noexcept;
  /// Buffer to write; empty if not guarding. Visible to the master after firmware_publish().
  std::span<std::uint8_t> firmware_buffer() noexcept;
  void firmware_publish() noexcept;

 private:
  static constexpr std::uint8_t kModeMask = 0x03;
  static constexpr std::uint8_t kMailboxMode = 0x02;
  static constexpr std::uint8_t kWrittenByMaster = 0x04;
  static constexpr std::uint8_t kWatchdogTrigger = 0x40;

  bool mailbox() const noexcept { return (control_ & kModeMask) == kMailboxMode; }
  bool master_writes() const noexcept { return (control_ & kWrittenByMaster) != 0; }
  std::uint8_t* buffer(std::uint8_t number) noexcept;
  void reset() noexcept;
  void publish() noexcept;
  void take_newest() noexcept;

  std::span<std::uint8_t> memory_;
  std::uint32_t start_ = 0;
  std::uint32_t end_ = 0;
  std::size_t length_ = 0;
  std::uint8_t control_ = 0;
  std::uint8_t enables_ = 0;  // enabled by the master, deactivated by the firmware
  bool guarding_ = false;
  bool locked_ = false;  // deactivated by the firmware: no access

  bool open_ = false;     // the master is within the area
  bool closing_ = false;  // ... and reached its last byte in this frame
  bool full_ = false;     // mailbox
  bool was_written_ = false;
  bool write_event_ = false;  // status bits 0 and 1
  bool read_event_ = false;

  std::uint8_t writer_ = 0;  // numbers of the three buffers
  std::uint8_t newest_ = 1;
  std::uint8_t reader_ = 2;
  std::uint8_t last_written_ = 0;
  bool fresh_ = false;  // the reader has not taken the newest one yet
};

}  // namespace sim::bus
