/// @file
/// A USB device implemented by a program and plugged into the kernel's virtual host controller (vhci_hcd):
/// the kernel's requests arrive through a socket, as USB/IP packets. Kernel, libusb and udev see a device
/// like any other. Source: the kernel's Documentation/usb/usbip_protocol.rst. Needs root.
#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace guest {

using Bytes = std::vector<std::uint8_t>;

enum class UsbSpeed : std::uint8_t { kFull = 2, kHigh = 3 };  ///< numbers of linux/usb/ch9.h

struct UsbIdentity {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string manufacturer_name = "";
  std::string product_name = "";
  std::string serial = "";  ///< empty strings are left out of the descriptor
};

/// One interface of one configuration; its endpoints as in their descriptors.
struct UsbEndpoint {
  std::uint8_t address = 0;  ///< bit 7: towards the host
  std::uint16_t packet_bytes = 64;
  bool interrupt = false;  ///< otherwise bulk
};
struct UsbDescription {
  UsbIdentity identity;
  UsbSpeed speed = UsbSpeed::kFull;
  std::uint8_t interface_class = 0xFF;  ///< vendor's own
  Bytes class_descriptor = {};          ///< between those of the interface and of the endpoints
  std::vector<UsbEndpoint> endpoints;
};

struct UsbSetup {
  std::uint8_t request_type = 0;  ///< bmRequestType
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  std::uint16_t length = 0;
};

enum class Handshake : std::uint8_t {
  kAck,
  kNak,    ///< nothing to send yet: the host asks again
  kStall,  ///< refused; an endpoint other than 0 stays halted until the host clears that
};

/// Behaviour of the device. All calls come from the device's own thread.
class UsbFunction {
 public:
  UsbFunction() = default;
  UsbFunction(const UsbFunction&) = delete;
  UsbFunction& operator=(const UsbFunction&) = delete;
  virtual ~UsbFunction() = default;

  /// Requests that are not answered from the description. `data` is the received data, or is to be filled.
  virtual Handshake control(const UsbSetup& setup, Bytes& data) = 0;
  /// kAck or kStall.
  virtual Handshake out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) = 0;
  /// One packet. While the host waits for one, this is called after everything that the host sends, and about
  /// every millisecond.
  virtual Handshake in(std::uint8_t endpoint, Bytes& packet) = 0;
};

class UsbipDevice {
 public:
  /// Plugs it in; the host finds it slightly later. `function` must outlive it.
  /// @throws std::runtime_error if there is no vhci_hcd, or no free port on it.
  UsbipDevice(UsbDescription description, UsbFunction& function);
  UsbipDevice(const UsbipDevice&) = delete;
  UsbipDevice& operator=(const UsbipDevice&) = delete;
  /// Unplugs it, and waits for kernel and udev to remove it, so that the next one of its kind is not mistaken
  /// for it.
  ~UsbipDevice();

  /// Unplugs the cable: nothing is answered any more. The host notices slightly later.
  void unplug();

 private:
  static constexpr std::size_t kHeaderBytes = 48;
  using Header = std::array<std::uint8_t, kHeaderBytes>;
  /// A transfer towards the host, until it is full or a short packet arrives.
  struct Waiting {
    std::uint32_t number = 0;
    std::uint8_t endpoint = 0;
    std::size_t room = 0;
    Bytes bytes;
  };

  void serve();
  bool take_packet();
  void submitted(const Header& header, Bytes data);
  void unlinked(const Header& header);
  void control(std::uint32_t number, const UsbSetup& setup, Bytes data);
  Handshake standard(const UsbSetup& setup, Bytes& data);
  Handshake out(std::uint8_t endpoint, std::span<const std::uint8_t> data);
  Handshake in(std::uint8_t endpoint, Bytes& packet);
  Bytes descriptor(const UsbSetup& setup) const;
  void fill_waiting();
  bool fill(Waiting& transfer);
  void complete(std::uint32_t number, int error, std::span<const std::uint8_t> data, std::size_t size);
  void send(const Header& header, std::span<const std::uint8_t> data) const;
  std::size_t packet_bytes(std::uint8_t endpoint) const;

  UsbDescription description_;
  UsbFunction& function_;
  int socket_ = -1;
  std::deque<Waiting> waiting_;
  std::set<std::uint8_t> halted_;  // endpoints, by address
  std::thread thread_;
};

}  // namespace guest
