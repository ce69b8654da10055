#include "sim/bus/slave_mailbox.h"

#include <algorithm>
#include <utility>

namespace sim::bus {

void SlaveMailbox::resize(std::size_t reply_bytes) {
  for (Message* const message : {&posted_, &displaced_, &current_, &delivered_})
    message->bytes.resize(reply_bytes);
}

void SlaveMailbox::clear() noexcept {
  posted_.valid = displaced_.valid = current_.valid = delivered_.valid = false;
}

bool SlaveMailbox::post(std::span<const std::uint8_t> reply) noexcept {
  if (posted_.valid || reply.size() > posted_.bytes.size()) return false;
  std::ranges::fill(std::ranges::copy(reply, posted_.bytes.begin()).out, posted_.bytes.end(),
                    std::uint8_t{0});
  posted_.valid = true;
  return true;
}

void SlaveMailbox::reply_read() noexcept {
  std::swap(delivered_, current_);
  current_.valid = false;
}

void SlaveMailbox::take_request(SyncManager& out, Application& application) noexcept {
  if (hung_ || !out.full()) return;
  const std::span<const std::uint8_t> request = out.firmware_read();
  if (request.empty() || application.mailbox_received(request)) out.firmware_release();
}

bool SlaveMailbox::repeat(SyncManager& in) noexcept {
  if (hung_) return false;
  if (delivered_.valid) {
    if (current_.valid) std::swap(displaced_, current_);
    std::swap(current_, delivered_);
    delivered_.valid = false;
    place(current_, in);
  }
  return true;  // also valid if there is nothing to repeat
}

void SlaveMailbox::hand_out(SyncManager& in) noexcept {
  if (hung_ || current_.valid) return;
  Message& next = displaced_.valid ? displaced_ : posted_;
  if (!next.valid) return;
  std::swap(current_, next);
  next.valid = false;
  place(current_, in);
}

void SlaveMailbox::place(Message& message, SyncManager& in) noexcept {
  const std::span<std::uint8_t> buffer = in.firmware_buffer();
  std::copy_n(message.bytes.begin(), std::min(buffer.size(), message.bytes.size()), buffer.begin());
  if (!buffer.empty()) in.firmware_publish();
}

}  // namespace sim::bus
