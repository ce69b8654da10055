/// @file
/// A USB device that the kernel does not have, for the real libusb: umockdev provides its directory in /sys
/// and its node in /dev/bus/usb, and libusb's requests to the node (usbfs, linux/usbdevice_fs.h) are answered
/// here. The program must run with umockdev's library preloaded; see tests/mock_kernel/CMakeLists.txt.
///
///   support::MockUsbBus bus;
///   support::MockUsbDevice device(bus, {.vendor = 0x0403, .product = 0xcb48});
///   device.on_out([&](int endpoint, Bytes bytes) { device.send(0x81, bytes); return 0; });
///
/// The node is a pseudo-terminal's, so that poll(2) waits as on usbfs: ready to write while a transfer waits
/// to be fetched, an error once the device is gone. One bus per process at a time.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace support {

using UsbBytes = std::vector<std::uint8_t>;

/// Whether umockdev is between this process and the kernel.
bool in_mock_kernel();

/// An empty machine with one root hub, usb1.
class MockUsbBus {
 public:
  MockUsbBus();
  MockUsbBus(const MockUsbBus&) = delete;
  MockUsbBus& operator=(const MockUsbBus&) = delete;
  ~MockUsbBus();

  /// Replaces "/".
  std::filesystem::path root() const;

 private:
  friend class MockUsbDevice;
  struct Testbed;
  std::unique_ptr<Testbed> testbed_;
};

/// Device, configuration 1, interface 0 of the vendor's class, bulk endpoints 0x02 OUT and 0x81 IN.
UsbBytes bulk_pair_descriptors(std::uint16_t vendor, std::uint16_t product, std::uint16_t packet_bytes = 64);

struct MockUsbOptions {
  std::uint16_t vendor = 0x0403;
  std::uint16_t product = 0xcb48;
  int port = 1;            ///< of the root hub: the device is 1-PORT
  int address = 2;         ///< never used by another device
  UsbBytes descriptors{};  ///< empty: bulk_pair_descriptors()
  std::string manufacturer = "NOVINT";
  std::string product_name = "FALCON HAPTIC";
  std::string serial{};
  int speed_Mbit_per_s = 12;
  std::string driver{};  ///< of the kernel, bound to interface 0
};

struct ControlRequest {
  std::uint8_t type = 0;
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  friend bool operator==(const ControlRequest&, const ControlRequest&) = default;
};

/// The host's requests to the kernel so far.
struct MockUsbCounts {
  int opens = 0;
  int claims = 0;
  int releases = 0;
  int detached = 0;  ///< the kernel's driver from the interface
  int attached = 0;
  int in_submitted = 0;
  int out_submitted = 0;
  int discarded = 0;
  int clear_halts = 0;
  int under_way_at_clear_halt = 0;  ///< transfers, at that endpoint: none should be
};

class MockUsbDevice {
 public:
  /// Plugged in.
  MockUsbDevice(MockUsbBus& bus, MockUsbOptions options);
  MockUsbDevice(const MockUsbDevice&) = delete;
  MockUsbDevice& operator=(const MockUsbDevice&) = delete;
  /// Unplugged.
  ~MockUsbDevice();

  // ---- the device's side; callbacks run on a thread of umockdev's, one at a time. After another one, or
  // none, is set, the caller may read their records ----

  /// 0, or a negative errno: -EPIPE is a stall. Without one: 0.
  void on_control(std::function<int(const ControlRequest&)> callback);
  void on_out(std::function<int(int endpoint, const UsbBytes&)> callback);
  /// For an IN transfer, at once or at the host's request; in order. More than fits is an overflow.
  void send(int endpoint, const UsbBytes& packet);
  /// The same with a failure, a negative errno instead of a packet. -EPIPE halts the endpoint: transfers
  /// under way stay there, later ones fail, until the host clears the halt.
  void fail_in(int endpoint, int error);
  /// Drops packets that no transfer has taken yet.
  void forget(int endpoint);

  // ---- faults ----

  /// OUT transfers stay under way after `taken` bytes, until released or cancelled.
  void hold_out(int taken = 0);
  void release_out();
  void refuse_claims(bool refuse);
  /// Everything under way fails, including poll(2) on the node, and udev reports it.
  void unplug();

  // ---- for tests ----

  MockUsbCounts counts() const;
  /// IN transfers of the host under way.
  int listening() const;
  /// Packets that no transfer has taken yet.
  int waiting() const;
  std::string node() const;  ///< /dev/bus/usb/001/002

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace support
