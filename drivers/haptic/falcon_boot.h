/// @file
/// Gets the Novint Falcon's firmware running. The device keeps it in RAM only: after power-on its boot loader
/// waits for an image, which it echoes byte by byte; the echo is the only check there is. No image comes with
/// this software: the user names one. Source: libnifalcon, FalconCommLibUSB.cpp.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/setup_error.h"
#include "drivers/usb/usb_port.h"

namespace drivers::haptic::falcon {

struct BootConfig {
  std::string device = "Falcon";  ///< for messages
  /// Firmware that runs may need some packets before its first reply. 200 at 5 ms last as long as the 1000
  /// at 1 kHz of libnifalcon.
  int alive_packets = 200;
  std::chrono::nanoseconds alive_timeout = std::chrono::milliseconds(5);
  int query_attempts = 100;
  std::chrono::nanoseconds query_timeout = std::chrono::milliseconds(50);  ///< 7 bytes at 9600 Bd: 7 ms
  int load_attempts = 10;  ///< several are normal in the field
  std::chrono::nanoseconds echo_timeout = std::chrono::milliseconds(200);  ///< 62 bytes and latency: 25 ms
  std::chrono::nanoseconds write_timeout = std::chrono::milliseconds(500);
};

/// Setup: sets the line up as the firmware expects it (1.5 MBd, latency 1 ms) and asks whether it replies.
/// Its motors get zero; a device that is homed stays so. @throws SetupError when the port fails.
bool firmware_answers(usb::UsbPort& port, const BootConfig& config);

enum class Firmware : std::uint8_t { kWasRunning, kLoaded };

/// Setup: loads `image` unless firmware is running already; then replies come. Takes up to minutes with a
/// device that does not cooperate.
/// @throws SetupError saying what to do: no image given, no answer (power, USB port), echo mismatch at which
/// byte, image that does not run, unplugged.
Firmware start_firmware(usb::UsbPort& port, std::span<const std::uint8_t> image, const BootConfig& config);

}  // namespace drivers::haptic::falcon
