/// @file
/// A network interface as EtherCAT link (AF_PACKET, EtherType 0x88A4).
#pragma once
#include <optional>
#include <string>

#include "drivers/ethercat/link.h"
#include "drivers/ethercat/reply_wait.h"
#include "drivers/interface_lock.h"

namespace drivers::ethercat {

/// A master's end: it has the interface for itself as long as it lives. Needs CAP_NET_RAW and nothing else:
/// the interface must be up already.
class RawSocketLink final : public Link {
 public:
  enum class Wait {
    /// Sleeps until the usual time of the reply, polls for at most 50 µs, then blocks; see ReplyWait. Eleven
    /// emulated slaves over a veth pair, medians of several runs: 41 to 57 µs a round trip, 51 to 62 µs of
    /// processor time a cycle; only blocking: 70 to 74 and 52 to 53.
    kBlock,
    kBusy,  ///< polls only: up to 10 µs faster there, and takes a whole core while it waits
  };

  /// Listens for 0.1 s before anything is sent.
  /// @throws BusError saying what to do: no such interface, interface down, no permission, another master at
  /// work; InterfaceInUse.
  RawSocketLink(const std::string& interface, Wait wait);
  ~RawSocketLink() override;

  bool send(std::span<const std::uint8_t> frame) noexcept override;
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override;
  std::chrono::nanoseconds frame_age() const noexcept override { return frame_age_; }
  int last_error() const noexcept override { return last_error_; }
  const std::string& name() const noexcept override { return interface_; }

 private:
  void refuse_other_masters();
  /// Until a frame comes, at most so long.
  void sleep(std::chrono::nanoseconds duration) noexcept;
  /// From the frame that has just been read. `blocked_since`: zero unless the thread was blocked when it
  /// came.
  void learn(std::chrono::nanoseconds blocked_since) noexcept;

  std::string interface_;
  Wait wait_;
  std::optional<InterfaceLock> lock_;
  int socket_ = -1;
  int last_error_ = 0;
  std::chrono::nanoseconds frame_age_{};
  ReplyWait reply_wait_;  // of Wait::kBlock
  std::chrono::nanoseconds sent_at_{};
  bool reply_is_due_ = false;
};

}  // namespace drivers::ethercat
