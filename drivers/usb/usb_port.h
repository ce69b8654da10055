/// @file
/// What an opened USB device offers to a protocol: vendor requests without data, and one pipe each way. It
/// is the seam at which an emulated device takes the place of the real one.
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
  kUnplugged,  ///< the device is gone and will not come back through this port
  kOther,      ///< see TransferResult::code
};

struct [[nodiscard]] TransferResult {
  TransferStatus status = TransferStatus::kDone;
  std::size_t size = 0;  ///< bytes that went over, also when the time was over
  int code = 0;          ///< the backend's own, for the log (libusb: enum libusb_error)
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
  /// All of `bytes`, or a status that says why not.
  virtual TransferResult write(std::span<const std::uint8_t> bytes,
                               std::chrono::nanoseconds timeout) noexcept = 0;
  /// Whole USB packets as they came, in order, as many as there are and fit, up to the first that is not
  /// full: give it a multiple of the endpoint's packet size. Waits for the first one only; timeout 0 takes
  /// what has already come and never waits (libusb's 0 waits for ever).
  virtual TransferResult read(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept = 0;
  /// Monotonic. A deadline reaches over several reads, because a device may send packets that hold nothing;
  /// an emulated device has a time of its own, so that its tests need not wait.
  virtual std::chrono::nanoseconds now() noexcept = 0;
};

}  // namespace drivers::usb
