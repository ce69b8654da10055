/// @file
/// A network interface as EtherCAT link (AF_PACKET, EtherType 0x88A4).
#pragma once
#include <optional>
#include <string>

#include "drivers/ethercat/link.h"
#include "drivers/interface_lock.h"

namespace drivers::ethercat {

/// A master's end: it has the interface for itself as long as it lives. Needs CAP_NET_RAW and nothing else:
/// the interface must be up already.
class RawSocketLink final : public Link {
 public:
  enum class Wait {
    kBlock,  ///< sleeps until a frame comes: about 45 µs a round trip, no CPU while waiting
    kBusy,   ///< polls: about 3 µs, a whole core while waiting
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

  std::string interface_;
  Wait wait_;
  std::optional<InterfaceLock> lock_;
  int socket_ = -1;
  int last_error_ = 0;
  std::chrono::nanoseconds frame_age_{};
};

}  // namespace drivers::ethercat
