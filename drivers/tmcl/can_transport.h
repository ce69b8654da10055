/// @file
/// TMCL over CAN: a bench rig with one Trinamic module.
#pragma once
#include <cstdint>
#include <string>

#include "drivers/can/socket_can.h"
#include "drivers/tmcl/transport.h"

namespace drivers::tmcl {

/// Defaults of the modules (TMCL manual, global parameters 71 and 70).
struct CanIdentifiers {
  std::uint32_t module = 1;
  std::uint32_t reply = 2;
};

/// Requests go to the drive at `module`; there is no gripper behind a CAN module. Sends 7 data bytes (8 for
/// the version text), accepts replies of 7 or 8. Older modules are set to 250 kbit/s, newer ones to 1 Mbit/s:
/// see SocketCanOptions.
class CanTransport final : public Transport {
 public:
  /// @throws SetupError if an identifier has more than 11 bits, or both are equal.
  explicit CanTransport(can::SocketCan socket, const CanIdentifiers& identifiers = {});

  bool post(const Request& request) noexcept override;
  std::optional<Reply> poll() noexcept override;
  std::chrono::nanoseconds reply_age() const noexcept override { return socket_.frame_age(); }
  const std::string& name() const noexcept override { return name_; }
  std::string transport_fault() const override;

  can::SocketCan& socket() noexcept { return socket_; }
  const can::SocketCan& socket() const noexcept { return socket_; }

 private:
  can::SocketCan socket_;
  CanIdentifiers identifiers_;
  std::string name_;
};

}  // namespace drivers::tmcl
