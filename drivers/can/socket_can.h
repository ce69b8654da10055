/// @file
/// CAN frames through the kernel's raw CAN socket: classic frames, one interface.
#pragma once
#include <linux/can.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/can/bus_error.h"
#include "drivers/interface_lock.h"
#include "drivers/setup_error.h"

namespace drivers::can {

struct SocketCanOptions {
  std::string interface = "can0";
  std::uint32_t receive_id = 2;  ///< 11 bits; frames with other identifiers are filtered out by the kernel
  /// Required bit rate of the interface; 0: any. Not set here: that takes an administrator.
  std::uint32_t bitrate_bit_per_s = 1'000'000;
};

enum class Received : std::uint8_t {
  kFrame,
  kNothing,   ///< within the time-out
  kBusError,  ///< an error frame: see SocketCan::bus_error()
  kFailed,    ///< see SocketCan::last_error()
};

/// Owns a socket and locks its interface against this project's other programs. One thread. send() and
/// receive() neither allocate nor throw.
class SocketCan {
 public:
  /// Setup. @throws SetupError with advice: no CAN in the kernel, no such interface, not a CAN interface,
  /// down, other bit rate, no permission; InterfaceInUse.
  explicit SocketCan(const SocketCanOptions& options);
  /// Takes over a socket that carries can_frame messages, such as a test's socketpair (SOCK_SEQPACKET).
  SocketCan(int socket, std::string name) noexcept;
  SocketCan(SocketCan&& other) noexcept;
  SocketCan& operator=(SocketCan&& other) noexcept;
  ~SocketCan();

  /// Cycle: false if the kernel did not take the frame within `timeout` (0: at once); see last_error().
  /// Without acknowledgement on the bus, ENOBUFS or a time-out follows once the queue is full.
  bool send(const can_frame& frame, std::chrono::nanoseconds timeout) noexcept;
  /// Cycle: at most one frame.
  Received receive(can_frame& frame, std::chrono::nanoseconds timeout) noexcept;

  /// Time that the last frame waited in the socket, from the kernel's stamp. Zero without a stamp.
  std::chrono::nanoseconds frame_age() const noexcept { return frame_age_; }

  /// The latest error frame.
  const BusError& bus_error() const noexcept { return bus_error_; }
  /// errno of the last failure of send() or receive(), 0 if none.
  int last_error() const noexcept { return last_error_; }
  /// Clears both, once the bus works again.
  void clear_errors() noexcept {
    bus_error_ = {};
    last_error_ = 0;
  }
  const std::string& name() const noexcept { return name_; }

 private:
  bool wait_for(short events, std::chrono::nanoseconds timeout) noexcept;

  int socket_ = -1;
  std::string name_;
  std::optional<InterfaceLock> lock_;  // none for a test's socketpair
  BusError bus_error_;
  int last_error_ = 0;
  std::chrono::nanoseconds frame_age_{};
};

/// Steps of opening that can fail.
enum class OpenStep : std::uint8_t { kSocket, kFind, kNotCan, kDown, kBitrate, kOptions, kBind };
/// Error message for this step and errno. `found_bit_per_s` is for kBitrate.
SetupError open_error(OpenStep step, int error, const SocketCanOptions& options,
                      std::uint32_t found_bit_per_s = 0);

}  // namespace drivers::can
