/// @file
/// The emulated Falcon for a driver: on its own port, or on a mocked kernel.
#pragma once
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <utility>

#include "drivers/usb/ftdi_serial.h"
#include "drivers/usb/usb_port.h"
#include "sim/devices/emulated_falcon.h"
#include "tests/support/mock_usb_device.h"

namespace support {

/// A port that may be destroyed while its target stays.
class BorrowedPort final : public drivers::usb::UsbPort {
 public:
  explicit BorrowedPort(drivers::usb::UsbPort& port) : port_(port) {}
  drivers::usb::TransferResult control_out(std::uint8_t request, std::uint16_t value,
                                           std::uint16_t index) noexcept override {
    return port_.control_out(request, value, index);
  }
  drivers::usb::TransferResult write(std::span<const std::uint8_t> bytes,
                                     std::chrono::nanoseconds timeout) noexcept override {
    return port_.write(bytes, timeout);
  }
  drivers::usb::TransferResult read(std::span<std::uint8_t> buffer,
                                    std::chrono::nanoseconds timeout) noexcept override {
    return port_.read(buffer, timeout);
  }
  std::chrono::nanoseconds now() noexcept override { return port_.now(); }

 private:
  drivers::usb::UsbPort& port_;
};

/// The emulated device has its own time: after each write it gets the time that it needs for its output, and
/// an empty packet after that, like the real one. Like the real one's chip, it keeps only some replies for a
/// host that does not fetch them, and none when commanded to drop them.
class MockFalcon {
 public:
  /// After each write of the host, in the device's thread.
  using AfterWrite = std::function<void(sim::devices::EmulatedFalcon&)>;

  MockFalcon(MockUsbBus& bus, sim::devices::EmulatedFalconOptions options, AfterWrite after_write = {})
      : falcon_(std::move(options)), after_write_(std::move(after_write)), usb_(bus, {}) {
    usb_.on_control([this](const ControlRequest& request) {
      const std::lock_guard lock(mutex_);
      constexpr auto kPurge = static_cast<std::uint8_t>(drivers::usb::ftdi::Request::kPurge);
      if (request.request == kPurge) usb_.forget(kIn);
      return error_of(falcon_.control_out(request.request, request.value, request.index));
    });
    usb_.on_out([this](int, const UsbBytes& bytes) {
      const std::lock_guard lock(mutex_);
      const int error = error_of(falcon_.write(bytes, std::chrono::nanoseconds(0)));
      if (after_write_) after_write_(falcon_);
      return error != 0 ? error : pump();
    });
  }

  MockUsbDevice& usb() { return usb_; }
  /// Access to the emulated device, excluding the other thread.
  template <typename Action>
  auto with(Action action) {
    const std::lock_guard lock(mutex_);
    return action(falcon_);
  }

 private:
  static constexpr int kIn = 0x81;
  static constexpr int kMaxWaiting = 32;  // packets, every other one is empty
  static int error_of(const drivers::usb::TransferResult& result) { return result.ok() ? 0 : -EPIPE; }

  int pump() {
    constexpr std::size_t kEmptyPacket = 2;
    for (std::size_t size = 0; size != kEmptyPacket;) {
      UsbBytes packet(64);
      const drivers::usb::TransferResult result = falcon_.read(packet, std::chrono::milliseconds(20));
      if (!result.ok()) {
        usb_.fail_in(kIn, -EPIPE);
        return 0;
      }
      size = result.size;
      packet.resize(size);
      if (usb_.waiting() < kMaxWaiting) usb_.send(kIn, packet);
    }
    return 0;
  }

  std::mutex mutex_;
  sim::devices::EmulatedFalcon falcon_;
  AfterWrite after_write_;
  MockUsbDevice usb_;
};

}  // namespace support
