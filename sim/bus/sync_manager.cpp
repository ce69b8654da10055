#include "sim/bus/sync_manager.h"

#include <algorithm>
#include <utility>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/registers.h"

namespace sim::bus {
namespace reg = drivers::ethercat::reg;

void SyncManager::configure(std::span<const std::uint8_t> registers,
                            std::span<std::uint8_t> memory) noexcept {
  using drivers::ethercat::load_le;
  memory_ = memory;
  start_ = load_le<std::uint16_t>(registers.data());
  length_ = load_le<std::uint16_t>(registers.data() + 2);
  control_ = registers[4];
  end_ = start_ + static_cast<std::uint32_t>(length_ * (mailbox() ? 1 : 3));
  const bool enabled = (registers[reg::kSyncManagerActivate] & 0x01) != 0;
  locked_ = (registers[reg::kSyncManagerPdi] & 0x01) != 0;
  // With length 0 or 1 it does not guard (section I, 8.5).
  guarding_ =
      enabled && length_ > 1 && start_ >= reg::kProcessMemory && end_ <= reg::kProcessMemory + memory.size();
  const auto enables = static_cast<std::uint8_t>((enabled ? 1 : 0) | (locked_ ? 2 : 0));
  if (std::exchange(enables_, enables) != enables) reset();
}

void SyncManager::reset() noexcept {
  open_ = closing_ = full_ = was_written_ = write_event_ = read_event_ = fresh_ = false;
  writer_ = 0;
  newest_ = 1;
  reader_ = 2;
}

std::uint8_t SyncManager::status() const noexcept {
  unsigned status = (write_event_ ? 0x01U : 0U) | (read_event_ ? 0x02U : 0U);
  if (mailbox()) {
    if (full_) status |= reg::kMailboxFull;
  } else {
    status |= was_written_ ? static_cast<unsigned>(last_written_) << 4 : 0x30U;  // 3: none yet
  }
  return static_cast<std::uint8_t>(status);
}

std::uint8_t* SyncManager::buffer(std::uint8_t number) noexcept {
  return memory_.data() + (start_ - reg::kProcessMemory) + (mailbox() ? 0 : number * length_);
}

bool SyncManager::master_write(std::uint32_t address, std::span<const std::uint8_t> bytes) noexcept {
  const std::size_t offset = address - start_;
  if (locked_ || !master_writes() || offset >= length_) return false;
  if (offset == 0) {
    // "closing": another datagram of this frame has just filled it.
    if (mailbox() && (full_ || closing_)) return false;
    open_ = true;
    read_event_ = false;
  }
  if (!open_) return false;
  const std::size_t count = std::min(bytes.size(), length_ - offset);
  std::copy_n(bytes.begin(), count, buffer(writer_) + offset);
  if (offset + count == length_) {
    open_ = false;
    closing_ = true;
  }
  return true;
}

bool SyncManager::master_read(std::uint32_t address, std::span<std::uint8_t> bytes) noexcept {
  const std::size_t offset = address - start_;
  if (locked_ || master_writes() || offset >= length_) return false;
  if (offset == 0) {
    if (mailbox() ? !full_ || closing_ : !was_written_) return false;
    open_ = true;
    write_event_ = false;
    if (!mailbox()) take_newest();
  }
  if (!open_) return false;
  const std::size_t count = std::min(bytes.size(), length_ - offset);
  std::copy_n(buffer(reader_) + offset, count, bytes.begin());
  if (offset + count == length_) {
    open_ = false;
    closing_ = true;
  }
  return true;
}

SyncManager::Event SyncManager::end_frame(bool good) noexcept {
  if (!std::exchange(closing_, false) || !good) return Event::kNone;
  if (!master_writes()) {
    full_ = false;
    read_event_ = true;
    return Event::kRead;
  }
  write_event_ = true;
  if (mailbox()) {
    full_ = true;
  } else {
    publish();
  }
  return Event::kWritten;
}

std::span<const std::uint8_t> SyncManager::firmware_read() noexcept {
  if (!guarding_ || locked_ || !(mailbox() ? full_ : was_written_)) return {};
  if (!mailbox()) take_newest();
  write_event_ = false;
  return {buffer(reader_), length_};
}

void SyncManager::firmware_release() noexcept {
  full_ = false;
  read_event_ = true;
}

std::span<std::uint8_t> SyncManager::firmware_buffer() noexcept {
  if (!guarding_ || locked_ || master_writes()) return {};
  return {buffer(writer_), length_};
}

void SyncManager::firmware_publish() noexcept {
  write_event_ = true;
  read_event_ = false;
  if (mailbox()) {
    full_ = true;
    open_ = false;
  } else {
    publish();
  }
}

void SyncManager::publish() noexcept {
  std::swap(writer_, newest_);
  last_written_ = newest_;
  fresh_ = was_written_ = true;
}

void SyncManager::take_newest() noexcept {
  if (std::exchange(fresh_, false)) std::swap(reader_, newest_);
}

}  // namespace sim::bus
