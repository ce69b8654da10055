/// @file
/// A real USB port for drivers that wait for replies in real time.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "drivers/usb/usb_port.h"

namespace support {

/// A port whose clock runs at a fiftieth of real time: the driver's time-outs last fifty times as long, and
/// no reply misses them on a busy machine.
class SlowPort final : public drivers::usb::UsbPort {
 public:
  explicit SlowPort(std::unique_ptr<drivers::usb::UsbPort> port) : port_(std::move(port)) {}
  drivers::usb::TransferResult control_out(std::uint8_t request, std::uint16_t value,
                                           std::uint16_t index) noexcept override {
    return port_->control_out(request, value, index);
  }
  drivers::usb::TransferResult write(std::span<const std::uint8_t> bytes,
                                     std::chrono::nanoseconds timeout) noexcept override {
    return port_->write(bytes, kSlower * timeout);
  }
  drivers::usb::TransferResult read(std::span<std::uint8_t> buffer,
                                    std::chrono::nanoseconds timeout) noexcept override {
    return port_->read(buffer, kSlower * timeout);
  }
  std::chrono::nanoseconds now() noexcept override { return port_->now() / kSlower; }

 private:
  static constexpr int kSlower = 50;
  std::unique_ptr<drivers::usb::UsbPort> port_;
};

}  // namespace support
