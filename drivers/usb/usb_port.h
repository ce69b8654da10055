/// @file
/// Interface of an opened USB device for a protocol: vendor requests without data, and one pipe each way. An
/// emulated device replaces the real one at this interface.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

namespace drivers::usb {

enum class TransferStatus : std::uint8_t {
  kDone,
  kTimeout,
  kStalled,    ///< the device refused the request or halted the endpoint; the port has cleared the halt
  kUnplugged,  ///< the device is gone and will not return through this port
  kOther,      ///< see TransferResult::code
};

struct [[nodiscard]] TransferResult {
  TransferStatus status = TransferStatus::kDone;
  std::size_t size = 0;  ///< bytes transferred, also after a time-out
  int code = 0;          ///< backend-specific, for the log (libusb: enum libusb_error)
  bool ok() const noexcept { return status == TransferStatus::kDone; }
};

/// One interface of one device, claimed. One thread. Cycle: everything; nothing here throws or allocates.
class UsbPort {
 public:
  UsbPort() = default;
  UsbPort(const UsbPort&) = delete;
  UsbPort& operator=(const UsbPort&) = delete;
  virtual ~UsbPort() = default;

  /// Vendor request to the device, host to device, no data (bmRequestType 0x40).
  virtual TransferResult control_out(std::uint8_t request, std::uint16_t value,
                                     std::uint16_t index) noexcept = 0;
  /// All of `bytes`, or a status with the reason.
  virtual TransferResult write(std::span<const std::uint8_t> bytes,
                               std::chrono::nanoseconds timeout) noexcept = 0;
  /// Complete USB packets in order, as many as are available and fit, up to the first that is not full: pass
  /// a multiple of the endpoint's packet size. Waits for the first one only; timeout 0 takes what has already
  /// arrived and never waits (libusb's 0 waits for ever).
  virtual TransferResult read(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept = 0;
  /// Monotonic. A deadline covers several reads, because a device may send empty packets; an emulated device
  /// has its own time, so that its tests need not wait.
  virtual std::chrono::nanoseconds now() noexcept = 0;
};

}  // namespace drivers::usb
