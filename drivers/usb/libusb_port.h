/// @file
/// UsbPort on a real device, through libusb's asynchronous transfers.
///
///   UsbContext context;
///   const auto found = context.devices({.vendor = 0x0403, .product = 0xcb48});
///   auto opened = LibusbPort::open(context, found.at(0), {.interface = 0, .out = 0x02, .in = 0x81}, {});
///   if (!opened.port) throw SetupError(...);    // of opened.refusal
///   falcon.activate(...);                       // Falcon falcon(*opened.port);
///
/// Some IN transfers are with the kernel at all times, each as long as one packet, so nothing is lost between
/// two reads. What came is kept in a queue, in order, failures among it. When nobody reads and the queue is
/// full, no more is asked for: the device holds on to what it has (USB's own flow control), and what read()
/// returns first is old. Nothing is dropped here.
///
/// Thread: one, the caller's; libusb's events are handled within the calls, by no thread of ours. libusb has
/// one per process that listens to udev, which no call waits for.
///
/// Real-time: nothing of ours allocates after open(). libusb does, with malloc, some hundred bytes for each
/// transfer that it submits and frees them when it is done; it locks mutexes that only its udev thread
/// shares; and waits in whole milliseconds, rounded up. A cycle that may not stand that belongs into a thread
/// of its own. Clearing a halt blocks for a control transfer, for as long as the kernel lets it (5 s).
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
  /// Setup. Opens the device, takes the interface from the kernel's driver if one has it (it gets it back in
  /// the destructor), claims it and starts to listen. `rules_file` as in usb_access.h. `context` has to
  /// outlive the port and is not shared with others.
  static Opened open(UsbContext& context, const UsbDevice& device, const UsbPipes& pipes,
                     const std::string& rules_file);
  /// Blocks until the transfers came back, at most a second.
  ~LibusbPort() override;

  /// Waits at most a second.
  TransferResult control_out(std::uint8_t request, std::uint16_t value,
                             std::uint16_t index) noexcept override;
  /// When the time is over the transfer is taken back, which may take up to a second more if the kernel does
  /// not return it, and is as a rule done at once.
  TransferResult write(std::span<const std::uint8_t> bytes,
                       std::chrono::nanoseconds timeout) noexcept override;
  /// A packet that did not fit its transfer shows as kOther, LIBUSB_ERROR_OVERFLOW; one of no bytes as kDone,
  /// size 0. A buffer that is smaller than the next packet: kOther, LIBUSB_ERROR_INVALID_PARAM, and the
  /// packet stays.
  TransferResult read(std::span<std::uint8_t> buffer, std::chrono::nanoseconds timeout) noexcept override;
  std::chrono::nanoseconds now() noexcept override;

  std::size_t packet_bytes() const noexcept { return packet_bytes_; }

  static constexpr std::size_t kListening = 4;  ///< IN transfers
  static constexpr std::size_t kQueued = 64;    ///< packets

 private:
  using Nanoseconds = std::chrono::nanoseconds;
  using Handle = std::unique_ptr<libusb_device_handle, void (*)(libusb_device_handle*)>;

  /// One of libusb's transfers and where it is.
  struct Transfer {
    std::unique_ptr<libusb_transfer, void (*)(libusb_transfer*)> usb;
    LibusbPort* port = nullptr;
    bool away = false;  ///< libusb has it: nothing of it may be touched
  };
  /// What came in: a packet, or the failure of a transfer.
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
  bool failed_ = false;  // a failure stands in the queue: no more is asked for until it was read
};

}  // namespace drivers::usb
