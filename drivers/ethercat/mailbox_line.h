/// @file
/// One slave's mailbox: a request out, its reply back, one datagram a frame.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/slave.h"

namespace drivers::ethercat {

/// Carries whole mailboxes; what is in them (headerless TMCL on the youBot, CoE with its header elsewhere) is
/// the caller's matter. One request is under way at a time. Without a header there is no number that tells a
/// reply from an older one, so the line takes care that no other reply is taken for it:
/// - The mailbox is read only when its status says that it is full. When that frame is lost and the mailbox
///   is empty, the frame has emptied it, and the slave is asked to repeat (sync manager repeat bit).
/// - Before a request is written, what waits in the mailbox is read and dropped: the reply to a request that
///   was given up, or unrequested mail. One that stayed would be taken for the reply to the next request,
///   whose own reply would be taken for the one after it, and so on.
/// A reply that comes later than that, the slave having taken the old request, cannot be told apart.
/// Cycle-safe after construction.
class MailboxLine {
 public:
  enum class Status : std::uint8_t { kIdle, kBusy, kReplied, kTimedOut };

  explicit MailboxLine(const Slave& slave);

  bool exists() const noexcept { return !out_.empty(); }
  Status status() const noexcept { return status_; }
  std::size_t request_capacity() const noexcept { return out_.size(); }

  /// Posts a request, padded with zeros to the mailbox' length, and forgets the last reply. False when one is
  /// under way, or the slave has no mailbox, or it is too long.
  bool post(std::span<const std::uint8_t> request, std::chrono::nanoseconds timeout) noexcept;
  /// Waits for mail without having asked for any, such as the further segments of a transfer.
  bool listen(std::chrono::nanoseconds timeout) noexcept;
  /// The whole mailbox of the reply; empty unless status() is kReplied.
  std::span<const std::uint8_t> reply() const noexcept;
  /// Back to idle; whatever was under way is given up.
  void clear() noexcept { status_ = Status::kIdle; }

  /// Adds what is next to a frame; false when nothing is, or it does not fit.
  bool add(FrameWriter& writer, std::uint8_t index, std::chrono::nanoseconds now) noexcept;
  /// In place of add() while the slave is out of reach: the request may time out.
  void expire(std::chrono::nanoseconds now) noexcept;
  void answer(const Datagram& datagram) noexcept;
  /// The frame with the last add() did not come back.
  void frame_lost() noexcept;

 private:
  enum class Ask : std::uint8_t {
    kLookForOld,  // is anything in the mailbox already?
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
  bool repeat_bit_ = false;  // as the request sets it
  bool old_first_ = false;   // the mailbox held an older request: its reply comes before ours
  bool timed_ = false;
  std::chrono::nanoseconds timeout_{};
  std::chrono::nanoseconds deadline_{};
};

}  // namespace drivers::ethercat
