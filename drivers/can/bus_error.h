/// @file
/// Error frames: the kernel's reports of CAN bus errors (linux/can/error.h).
#pragma once
#include <linux/can.h>

#include <array>
#include <cstdint>
#include <string>

namespace drivers::can {

/// Content of an error frame as received. All zero: no error.
struct BusError {
  std::uint32_t classes = 0;  ///< CAN_ERR_...: several may be set
  std::array<std::uint8_t, 8> details{};
  friend bool operator==(const BusError&, const BusError&) = default;

  bool any() const noexcept { return classes != 0; }
  /// The controller has disconnected itself; only a restart brings it back.
  bool bus_off() const noexcept;
  /// No acknowledgement: alone on the bus, wrong bit rate, or no termination.
  bool no_acknowledge() const noexcept;
};

/// Cycle: true, with `error` set, if `frame` is an error frame.
bool decode_error_frame(const can_frame& frame, BusError& error) noexcept;

/// Text with advice: "bus off (check wiring ...), transmit error counter 255".
std::string describe(const BusError& error);

}  // namespace drivers::can
