#include "drivers/ethercat/mailbox_line.h"

#include <algorithm>

#include "drivers/ethercat/registers.h"

namespace drivers::ethercat {
namespace {

constexpr std::uint16_t kOutManager = reg::kSyncManager;
constexpr std::uint16_t kInManager = reg::kSyncManager + 1 * reg::kSyncManagerBytes;

}  // namespace

MailboxLine::MailboxLine(const Slave& slave)
    : station_(slave.station), out_window_(slave.sii.mailbox_out), in_window_(slave.sii.mailbox_in) {
  if (!slave.mailbox_fits) return;
  out_.resize(out_window_.length);
  in_.resize(in_window_.length);
}

bool MailboxLine::post(std::span<const std::uint8_t> request, std::chrono::nanoseconds timeout) noexcept {
  if (!exists() || status_ == Status::kBusy || request.size() > out_.size()) return false;
  std::fill(std::copy(request.begin(), request.end(), out_.begin()), out_.end(), std::uint8_t{0});
  ask_ = Ask::kLookForOld;
  old_first_ = false;
  status_ = Status::kBusy;
  timeout_ = timeout;
  timed_ = false;
  return true;
}

bool MailboxLine::listen(std::chrono::nanoseconds timeout) noexcept {
  if (!exists() || status_ == Status::kBusy) return false;
  ask_ = Ask::kLook;
  old_first_ = false;
  status_ = Status::kBusy;
  timeout_ = timeout;
  timed_ = false;
  return true;
}

std::span<const std::uint8_t> MailboxLine::reply() const noexcept {
  return status_ == Status::kReplied ? std::span<const std::uint8_t>(in_) : std::span<const std::uint8_t>();
}

void MailboxLine::expire(std::chrono::nanoseconds now) noexcept {
  if (status_ != Status::kBusy) return;
  if (!timed_) {
    timed_ = true;
    deadline_ = now + timeout_;
  }
  if (now > deadline_) status_ = Status::kTimedOut;
}

bool MailboxLine::add(FrameWriter& writer, std::uint8_t index, std::chrono::nanoseconds now) noexcept {
  expire(now);
  if (status_ != Status::kBusy) return false;
  const auto read = [&](std::uint16_t address, std::size_t length) {
    return writer.add(Command::kFprd, index, address_of(station_, address), length).counter != nullptr;
  };
  switch (ask_) {
    case Ask::kWrite: {
      const Datagram datagram =
          writer.add(Command::kFpwr, index, address_of(station_, out_window_.start), out_.size());
      std::copy_n(out_.begin(), datagram.data.size(), datagram.data.begin());
      return datagram.counter != nullptr;
    }
    case Ask::kLookWhyRefused: return read(kOutManager + reg::kSyncManagerStatus, 1);
    case Ask::kLookAfterLoss: return read(kInManager + reg::kSyncManagerStatus, 3);  // and the repeat bits
    case Ask::kLookForOld:
    case Ask::kLook: return read(kInManager + reg::kSyncManagerStatus, 1);
    case Ask::kDropOld:
    case Ask::kRead: return read(in_window_.start, in_.size());
    case Ask::kRepeat: {
      const Datagram datagram =
          writer.add(Command::kFpwr, index, address_of(station_, kInManager + reg::kSyncManagerActivate), 1);
      if (datagram.counter == nullptr) return false;
      datagram.data[0] =
          static_cast<std::uint8_t>(reg::kSyncManagerEnabled | (repeat_bit_ ? reg::kRepeatRequest : 0));
      return true;
    }
    case Ask::kRepeatAcknowledged: return read(kInManager + reg::kSyncManagerPdi, 1);
  }
  return false;
}

void MailboxLine::answer(const Datagram& datagram) noexcept {
  if (status_ != Status::kBusy) return;
  if (datagram.working_counter() == 0) {
    // Full when written, empty when read, or unreachable. The same is asked again, after a check.
    if (ask_ == Ask::kWrite) ask_ = Ask::kLookWhyRefused;
    if (ask_ == Ask::kRead) ask_ = Ask::kLook;
    if (ask_ == Ask::kDropOld) ask_ = Ask::kLookForOld;
    return;
  }
  const bool full = (datagram.data[0] & reg::kMailboxFull) != 0;  // where it is a status
  switch (ask_) {
    case Ask::kLookForOld: ask_ = full ? Ask::kDropOld : Ask::kWrite; break;
    case Ask::kDropOld:
      old_first_ = false;
      ask_ = Ask::kLookForOld;
      break;
    case Ask::kWrite: ask_ = Ask::kLook; break;
    case Ask::kLookWhyRefused:
      old_first_ = old_first_ || full;
      ask_ = Ask::kLookForOld;
      break;
    case Ask::kLook:
      if (full) ask_ = Ask::kRead;
      break;
    case Ask::kRead:
      if (old_first_) {
        old_first_ = false;
        ask_ = Ask::kLook;
        break;
      }
      std::copy_n(datagram.data.begin(), in_.size(), in_.begin());
      status_ = Status::kReplied;
      break;
    case Ask::kLookAfterLoss:
      repeat_bit_ = (datagram.data[2] & reg::kRepeatAcknowledge) == 0;
      ask_ = full ? Ask::kRead : Ask::kRepeat;
      break;
    case Ask::kRepeat: ask_ = Ask::kRepeatAcknowledged; break;
    case Ask::kRepeatAcknowledged:
      if (((datagram.data[0] & reg::kRepeatAcknowledge) != 0) == repeat_bit_) ask_ = Ask::kLook;
      break;
  }
}

void MailboxLine::frame_lost() noexcept {
  if (status_ != Status::kBusy) return;
  if (ask_ == Ask::kDropOld) ask_ = Ask::kLookForOld;
  if (ask_ == Ask::kRead) ask_ = Ask::kLookAfterLoss;
  // A lost write may have arrived, and a duplicate request is worse than none: wait for its reply, and time
  // out if there is none.
  if (ask_ == Ask::kWrite) ask_ = Ask::kLook;
}

}  // namespace drivers::ethercat
