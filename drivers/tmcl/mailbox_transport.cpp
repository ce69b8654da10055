#include "drivers/tmcl/mailbox_transport.h"

#include <exception>

namespace drivers::tmcl {
namespace {

/// The time a request queue waits for a reply and then for a late one: afterwards the line must be free.
constexpr std::chrono::milliseconds kPatience{180};

std::optional<Reply> decode(std::span<const std::uint8_t> mailbox) noexcept {
  if (mailbox.size() < kMailboxBytes) return std::nullopt;
  return decode_mailbox_reply(mailbox.first(kMailboxBytes));
}

}  // namespace

bool MailboxTransport::post(const Request& request) noexcept {
  return line_.post(encode_mailbox(request), kPatience);
}

std::optional<Reply> MailboxTransport::poll() noexcept {
  if (line_.status() == ethercat::MailboxLine::Status::kTimedOut) line_.clear();
  if (line_.status() != ethercat::MailboxLine::Status::kReplied) return std::nullopt;
  const std::optional<Reply> reply = decode(line_.reply());
  line_.clear();
  return reply;
}

SetupMailboxTransport::SetupMailboxTransport(ethercat::PreOpBus& bus, std::size_t slave)
    : bus_(bus), slave_(slave), name_(bus.slaves()[slave].label()) {}

bool SetupMailboxTransport::post(const Request& request) noexcept {
  reply_.reset();
  try {
    reply_ = decode(bus_.mailbox_exchange(slave_, encode_mailbox(request)));
  } catch (const std::exception& error) {
    transport_fault_ = error.what();  // reported by the client, which knows the request
    return false;
  }
  return true;
}

}  // namespace drivers::tmcl
