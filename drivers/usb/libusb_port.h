/// @file
/// UsbPort on a real device, through libusb's asynchronous transfers.
///
///   UsbContext context;
///   const auto found = context.devices({.vendor = 0x0403, .product = 0xcb48});
///   auto opened = LibusbPort::open(context, found.at(0), {.interface = 0, .out = 0x02, .in = 0x81}, {});
///   if (!opened.port) throw SetupError(...);    // of opened.refusal
///   falcon.activate(...);                       // Falcon falcon(*opened.port);
///
/// Some IN transfers are always pending in the kernel, each one packet long, so nothing is lost between two
/// reads. Received packets and failures are queued in order. If nothing reads and the queue is full, no more
/// is requested: the device keeps its data (USB flow control), and what read() returns first is old. Nothing
/// is dropped here.
///
/// Thread: one, the caller's; libusb's events are handled within the calls, not by a thread of this class.
/// libusb has one thread per process that listens to udev; no call waits for it.
///
/// Real-time: this class does not allocate after open(). libusb does: malloc, some hundred bytes for each
/// transfer that it submits, freed when it is done. It locks mutexes that only its udev thread shares, and
/// waits in whole milliseconds, rounded up. A cycle that cannot tolerate this needs its own thread. Clearing
/// a halt blocks for a control transfer, for as long as the kernel allows (5 s).
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/usb/usb_access.h"
#include "drivers/usb/usb_devices.h"
#include "drivers/usb/usb_port.h"

struct libusb_device_handle;
struct libusb_transfer;

namespace drivers::usb {

struct UsbPipes {
  std::uint8_t interface = 0;
  std::uint8_t out = 0;  ///< endpoint address, bit 7 clear
  std::uint8_t in = 0;   ///< endpoint address, bit 7 set
};

class LibusbPort final : public UsbPort {
 public:
  struct Opened {
    std::unique_ptr<LibusbPort> port;  ///< empty: see refusal
    Refusal refusal{};
  };
  /// Setup. Opens the device, detaches the kernel driver from the interface if there is one (the destructor
  /// reattaches it), claims the interface and starts to listen. `rules_file` as in usb_access.h. `context`
  /// must outlive the port and must not be shared.
  static Opened open(UsbContext& context, const UsbDevice& device, const UsbPipes& pipes,
                     const std::string& rules_file);
  /// Blocks until the transfers have returned, at most a second.
  ~LibusbPort() override;

  /// Waits at most a second.
  TransferResult control_out(std::uint8_t request, std::uint16_t value,
                             std::uint16_t index) noexcept override;
  /// After the time-out the transfer is cancelled. This is usually immediate, but may take up to another
  /// second if the kernel does not return it.
  TransferResult write(std::span<const std::uint8_t> bytes,
                       std::chrono::nanoseconds timeout) noexcept override;
  /// A packet larger than its transfer is reported as kOther, LIBUSB_ERROR_OVERFLOW; an empty one as kDone,
  /// size 0. A buffer smaller than the next packet: kOther, LIBUSB_ERROR_INVALID_PARAM, and the packet stays.
  TransferResult read(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override;
  std::chrono::nanoseconds now() noexcept override;

  std::size_t packet_bytes() const noexcept { return packet_bytes_; }

  static constexpr std::size_t kListening = 4;  ///< IN transfers
  static constexpr std::size_t kQueued = 64;    ///< packets

 private:
  using Nanoseconds = std::chrono::nanoseconds;
  using Handle = std::unique_ptr<libusb_device_handle, void (*)(libusb_device_handle*)>;

  /// One of libusb's transfers and its state.
  struct Transfer {
    std::unique_ptr<libusb_transfer, void (*)(libusb_transfer*)> usb;
    LibusbPort* port = nullptr;
    bool away = false;  ///< owned by libusb: it must not be touched
  };
  /// A queued packet, or the failure of a transfer.
  struct Arrival {
    TransferStatus status = TransferStatus::kDone;
    int code = 0;
    std::size_t size = 0;
  };

  LibusbPort(libusb_context* context, const UsbPipes& pipes, Handle device, std::size_t packet_bytes);
  std::span<std::uint8_t> queue_slot(std::size_t index) noexcept;
  void listen() noexcept;
  bool listening() const noexcept;
  int submit(Transfer& transfer) noexcept;
  void received(Transfer& transfer) noexcept;
  bool handle_events(Nanoseconds timeout) noexcept;
  bool wait_for_return(const Transfer& transfer, Nanoseconds timeout) noexcept;
  TransferResult run(Transfer& transfer, Nanoseconds timeout) noexcept;
  TransferResult recover(Arrival failure) noexcept;
  int clear_halt(std::uint8_t endpoint) noexcept;

  libusb_context* context_;
  UsbPipes pipes_;
  Handle device_;
  std::size_t packet_bytes_;
  bool unplugged_ = false;
  int listen_error_ = 0;               // of the latest submission of an IN transfer, or of libusb's events
  std::vector<std::uint8_t> buffers_;  // control; OUT; one of each IN transfer; queued packets
  Transfer control_;
  Transfer out_;
  std::vector<Transfer> in_;

  std::array<Arrival, kQueued> queue_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  bool failed_ = false;  // a failure is queued: no more is requested until it has been read
};

}  // namespace drivers::usb
