/// @file
/// The FTDI chip that connects a serial line to USB: its vendor requests, and the status bytes it puts in
/// front of received data. Source: libftdi and libnifalcon (FalconCommLibUSB.cpp). Cycle: everything.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

namespace drivers::usb::ftdi {

/// bRequest of UsbPort::control_out(); the comment gives its wValue, wIndex is 0.
enum class Request : std::uint8_t {
  kPurge = 0,         ///< kPurgeReceived, kPurgeToSend
  kModemControl = 1,  ///< kDtr..., kRts...
  kFlowControl = 2,   ///< 0: none
  kBaudDivisor = 3,   ///< see divisor constants
  kLineFormat = 4,    ///< kEightBitsNoParityOneStop
  kLatencyTimer = 9,  ///< milliseconds that received bytes, or none, wait for more before they are sent
};

inline constexpr std::uint16_t kPurgeReceived = 1;
inline constexpr std::uint16_t kPurgeToSend = 2;
// High byte: which line; low byte: its level.
inline constexpr std::uint16_t kDtrLow = 0x0100;
inline constexpr std::uint16_t kDtrHigh = 0x0101;
inline constexpr std::uint16_t kRtsLow = 0x0200;
inline constexpr std::uint16_t kEightBitsNoParityOneStop = 8;

// 3 MHz over the divisor; bit 14 alone adds one half to the low 14 bits.
inline constexpr std::uint16_t kDivisor9600 = 0x4138;     // 312.5
inline constexpr std::uint16_t kDivisor142857 = 0x0015;   // 21
inline constexpr std::uint16_t kDivisor1500000 = 0x0002;  // 2

inline constexpr std::size_t kPacketBytes = 64;      ///< full speed bulk
inline constexpr std::size_t kModemStatusBytes = 2;  ///< at the start of each packet; alone: nothing received

/// Removes the modem status from consecutive packets, all but the last one full. Works in place; the result
/// is the front part of `packets`. A truncated packet of one byte holds no data.
std::span<std::uint8_t> strip_modem_status(std::span<std::uint8_t> packets) noexcept;

}  // namespace drivers::usb::ftdi
