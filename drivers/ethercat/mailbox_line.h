/// @file
/// One slave's mailbox: a request out, its reply back, one datagram per frame.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/slave.h"

namespace drivers::ethercat {

/// Carries whole mailboxes; the caller interprets the content (headerless TMCL on the youBot, CoE with its
/// header elsewhere). One request is under way at a time. Without a header, no number distinguishes a reply
/// from an older one, so the line ensures that no other reply is mistaken for it:
/// - The mailbox is read only if its status is full. If that frame is lost and the mailbox is empty, the
///   frame has emptied it, and the slave is asked to repeat (sync manager repeat bit).
/// - Before a request is written, waiting mail is read and dropped: the reply to an abandoned request, or
///   unrequested mail. Otherwise it would be mistaken for the reply to the next request, whose own reply
///   would be mistaken for the one after it, and so on.
/// A reply that arrives even later, because the slave had taken the old request, cannot be distinguished.
/// Cycle-safe after construction.
class MailboxLine {
 public:
  enum class Status : std::uint8_t { kIdle, kBusy, kReplied, kTimedOut };

  explicit MailboxLine(const Slave& slave);

  bool exists() const noexcept { return !out_.empty(); }
  Status status() const noexcept { return status_; }
  std::size_t request_capacity() const noexcept { return out_.size(); }

  /// Posts a request, padded with zeros to the mailbox length, and drops the last reply. False if a request
  /// is under way, the slave has no mailbox, or the request is too long.
  bool post(std::span<const std::uint8_t> request, std::chrono::nanoseconds timeout) noexcept;
  /// Waits for mail without a request, such as the further segments of a transfer.
  bool listen(std::chrono::nanoseconds timeout) noexcept;
  /// The whole mailbox of the reply; empty unless status() is kReplied.
  std::span<const std::uint8_t> reply() const noexcept;
  /// Back to idle; abandons a request under way.
  void clear() noexcept { status_ = Status::kIdle; }

  /// Adds the next datagram to a frame; false if there is none, or it does not fit.
  bool add(FrameWriter& writer, std::uint8_t index, std::chrono::nanoseconds now) noexcept;
  /// Call instead of add() while the slave is unreachable: the request may time out.
  void expire(std::chrono::nanoseconds now) noexcept;
  void answer(const Datagram& datagram) noexcept;
  /// The frame of the last add() did not come back.
  void frame_lost() noexcept;

 private:
  enum class Ask : std::uint8_t {
    kLookForOld,  // is the mailbox full already?
    kDropOld,
    kWrite,
    kLookWhyRefused,
    kLook,  // is the reply there?
    kRead,
    kLookAfterLoss,
    kRepeat,
    kRepeatAcknowledged
  };

  std::uint16_t station_ = 0;
  MailboxWindow out_window_;
  MailboxWindow in_window_;
  std::vector<std::uint8_t> out_;
  std::vector<std::uint8_t> in_;
  Status status_ = Status::kIdle;
  Ask ask_ = Ask::kLookForOld;
  bool repeat_bit_ = false;  // current value of the bit
  bool old_first_ = false;   // the mailbox held an older request: its reply precedes ours
  bool timed_ = false;
  std::chrono::nanoseconds timeout_{};
  std::chrono::nanoseconds deadline_{};
};

}  // namespace drivers::ethercat
