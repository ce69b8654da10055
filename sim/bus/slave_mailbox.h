/// @file
/// The firmware's side of a mailbox: accepts requests, returns replies, repeats a lost one.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/bus/application.h"
#include "sim/bus/sync_manager.h"

namespace sim::bus {

/// Repeats as required by ETG.1000.4 (section 6.7.4; ESC data sheet section I, 8.6): the last reply that the
/// master has read is kept; when the master toggles the repeat request, it is put back before newer ones and
/// the acknowledge bit follows.
class SlaveMailbox {
 public:
  /// Setup: `reply_bytes` is the length of the mailbox towards the master.
  void resize(std::size_t reply_bytes);

  void clear() noexcept;
  /// One deep: false while the previous one is waiting, and if it is too long.
  bool post(std::span<const std::uint8_t> reply) noexcept;
  /// A hung firmware neither accepts requests nor returns or repeats replies.
  void hang(bool hung) noexcept { hung_ = hung; }
  bool hung() const noexcept { return hung_; }

  /// The master emptied the mailbox.
  void reply_read() noexcept;
  /// Offers a waiting request to the application.
  void take_request(SyncManager& out, Application& application) noexcept;
  /// The repeat request differs from the acknowledge. True: done, the acknowledge may follow.
  bool repeat(SyncManager& in) noexcept;
  /// Fills an empty mailbox with the waiting reply.
  void hand_out(SyncManager& in) noexcept;

 private:
  struct Message {
    std::vector<std::uint8_t> bytes;
    bool valid = false;
  };
  static void place(Message& message, SyncManager& in) noexcept;

  Message posted_;     // waiting
  Message displaced_;  // displaced from the mailbox by the repeat of an older one
  Message current_;    // in the mailbox
  Message delivered_;  // read by the master, kept for a repeat
  bool hung_ = false;
};

}  // namespace sim::bus
