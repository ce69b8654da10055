/// @file
/// Error frames: how the kernel tells what is wrong on a CAN bus (linux/can/error.h).
#pragma once
#include <linux/can.h>

#include <array>
#include <cstdint>
#include <string>

namespace drivers::can {

/// The content of an error frame, as it came. All zero: no error.
struct BusError {
  std::uint32_t classes = 0;  ///< CAN_ERR_...: several may be set
  std::array<std::uint8_t, 8> details{};
  friend bool operator==(const BusError&, const BusError&) = default;

  bool any() const noexcept { return classes != 0; }
  /// The controller has cut itself off; it comes back by a restart only.
  bool bus_off() const noexcept;
  /// Nobody acknowledges: alone on the bus, wrong bit rate, or no termination.
  bool no_acknowledge() const noexcept;
};

/// Cycle: true, and `error` set, when `frame` is an error frame.
bool decode_error_frame(const can_frame& frame, BusError& error) noexcept;

/// In words, with what to check: "bus off (check wiring ...), transmit error counter 255".
std::string describe(const BusError& error);

}  // namespace drivers::can
