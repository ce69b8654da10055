#include "tests/faults/faulty_link.h"

#include <algorithm>

#include "drivers/ethercat/registers.h"
#include "tests/drivers/ethercat_fakes.h"

namespace faults {

namespace ethercat = drivers::ethercat;

bool FaultyLink::happens(double probability) noexcept {
  return probability > 0 && std::uniform_real_distribution<>(0, 1)(random_) < probability;
}

std::size_t FaultyLink::any_of(std::size_t count) noexcept {
  return std::uniform_int_distribution<std::size_t>(0, count - 1)(random_);
}

void FaultyLink::send_as_other_master(std::uint16_t al_control) noexcept {
  const ethercat::Command command = al_control == 0 ? ethercat::Command::kBrd : ethercat::Command::kBwr;
  const std::uint16_t address = al_control == 0 ? ethercat::reg::kAlStatus : ethercat::reg::kAlControl;
  (void)wire_->send(
      ethercat::test::frame_of_another_master(command, ethercat::address_of(0, address), al_control));
}

bool FaultyLink::send(std::span<const std::uint8_t> frame) noexcept {
  error_ = faults_.send_error;
  if (error_ != 0) return false;
  if (faults_.silent || happens(faults_.loses_request)) return true;
  if (happens(faults_.adds_other_master)) send_as_other_master(0);
  if (happens(faults_.resets_by_other_master)) send_as_other_master(1);
  return wire_->send(frame);
}

std::size_t FaultyLink::receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept {
  const std::chrono::nanoseconds end = now() + timeout;
  error_ = faults_.receive_error;
  if (error_ != 0) {
    wire_->wait(timeout);
    return 0;
  }
  if (happens(faults_.adds_strangers)) {
    Bytes stranger(60 + any_of(200));
    std::generate(stranger.begin(), stranger.end(), [this] { return static_cast<std::uint8_t>(random_()); });
    stranger[12] = ethercat::kEtherType >> 8U;
    stranger[13] = ethercat::kEtherType & 0xFFU;
    waiting_.push_back(std::move(stranger));
  }
  waiting_.insert(waiting_.end(), held_back_.begin(), held_back_.end());
  held_back_.clear();
  while (true) {
    std::size_t size = 0;
    if (!waiting_.empty()) {
      size = std::min(buffer.size(), waiting_.front().size());
      std::copy_n(waiting_.front().begin(), size, buffer.begin());
      waiting_.pop_front();
      return damage(buffer, size);
    }
    size = wire_->receive(buffer, std::max(end - now(), std::chrono::nanoseconds{}));
    if (size == 0) return 0;
    size = delay(buffer, size);
    if (size != 0) return damage(buffer, size);
  }
}

/// Size of the frame that arrives now, the current or an earlier one; 0: none.
std::size_t FaultyLink::delay(std::span<std::uint8_t> buffer, std::size_t size) noexcept {
  if (faults_.silent || happens(faults_.loses_reply)) return 0;
  const auto copy = [&] { return Bytes(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size)); };
  if (happens(faults_.repeats)) waiting_.push_back(copy());
  if (happens(faults_.holds_back)) {
    held_back_.push_back(copy());
    return 0;
  }
  if (!earlier_.empty() && happens(faults_.replays)) {
    size = std::min(buffer.size(), earlier_.size());
    std::copy_n(earlier_.begin(), size, buffer.begin());
    return size;
  }
  if (any_of(10) == 0) earlier_ = copy();
  return size;
}

/// The size that is left.
std::size_t FaultyLink::damage(std::span<std::uint8_t> buffer, std::size_t size) noexcept {
  constexpr std::size_t kHeader = ethercat::kEthernetHeaderBytes;
  if (happens(faults_.damages))
    buffer[kHeader + any_of(size - kHeader)] ^= static_cast<std::uint8_t>(1 + any_of(255));
  if (happens(faults_.miscounts)) {
    // Working counter of each datagram: one slave more or less.
    bool more = true;
    for (std::size_t at = ethercat::kFrameHeaderBytes; more;) {
      if (at + ethercat::kDatagramOverheadBytes > size) break;
      const std::size_t length = buffer[at + 6] | (buffer[at + 7] & 0x07U) << 8U;
      more = (buffer[at + 7] & 0x80U) != 0;
      const std::size_t counter = at + ethercat::kDatagramHeaderBytes + length;
      if (counter >= size) break;
      buffer[counter] ^= 1U;
      at = counter + ethercat::kCounterBytes;
    }
  }
  if (happens(faults_.truncates)) size = kHeader + any_of(size - kHeader);
  return size;
}

}  // namespace faults
