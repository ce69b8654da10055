/// @file
/// A network interface as EtherCAT link (AF_PACKET, EtherType 0x88A4).
#pragma once
#include <optional>
#include <string>

#include "drivers/ethercat/link.h"
#include "drivers/ethercat/reply_wait.h"
#include "drivers/interface_lock.h"

namespace drivers::ethercat {

/// The master's end; it locks the interface for its lifetime. Needs only CAP_NET_RAW: the interface must
/// already be up.
class RawSocketLink final : public Link {
 public:
  enum class Wait {
    /// Sleeps until the usual time of the reply, polls for at most 50 µs, then blocks; see ReplyWait. Eleven
    /// emulated slaves over a veth pair, medians of several runs: 41 to 57 µs per round trip, 51 to 62 µs of
    /// processor time per cycle; only blocking: 70 to 74 and 52 to 53.
    kBlock,
    kBusy,  ///< polls only: up to 10 µs faster there, but occupies a core while it waits
  };

  /// Listens for 0.1 s before anything is sent.
  /// @throws BusError with advice: no such interface, interface down, no permission, another active master;
  /// InterfaceInUse.
  RawSocketLink(const std::string& interface, Wait wait);
  ~RawSocketLink() override;

  bool send(std::span<const std::uint8_t> frame) noexcept override;
  std::size_t receive(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override;
  std::chrono::nanoseconds frame_age() const noexcept override { return frame_age_; }
  int last_error() const noexcept override { return last_error_; }
  const std::string& name() const noexcept override { return interface_; }

 private:
  void refuse_other_masters();
  /// Until a frame arrives, at most for `duration`.
  void sleep(std::chrono::nanoseconds duration) noexcept;
  /// Updates the estimate from the frame just read. `blocked_since`: zero unless the thread was blocked when
  /// it arrived.
  void learn(std::chrono::nanoseconds blocked_since) noexcept;

  std::string interface_;
  Wait wait_;
  std::optional<InterfaceLock> lock_;
  int socket_ = -1;
  int last_error_ = 0;
  std::chrono::nanoseconds frame_age_{};
  ReplyWait reply_wait_;  // for Wait::kBlock
  std::chrono::nanoseconds sent_at_{};
  bool reply_is_due_ = false;
};

}  // namespace drivers::ethercat
