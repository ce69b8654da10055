/// @file
/// Lists USB devices and reports arrivals and removals. Nothing here sends a byte to a device or opens one:
/// descriptors and strings are the kernel's copies. Setup: everything.
///
/// libusb has its own thread per process, which listens to udev while a context exists; this code has no
/// thread, and none of its functions is called outside UsbWatch::poll().
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/usb/system_paths.h"

struct libusb_context;
struct libusb_device;

namespace drivers::usb {

enum class UsbSpeed : std::uint8_t { kUnknown, kLow, kFull, kHigh, kSuper, kSuperPlus };
/// "full speed, 12 Mbit/s"
const char* describe(UsbSpeed speed) noexcept;

/// Properties at the time of the search; the device may be gone by now.
struct UsbDevice {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::uint8_t bus = 0;
  std::uint8_t address = 0;  ///< a new one each time it is plugged in
  std::string port_path{};   ///< "1-1.2": bus 1, port 1, port 2 of the hub there; "usb1": the root itself.
                             ///< Constant for a socket, and distinguishes identical devices
  UsbSpeed speed = UsbSpeed::kUnknown;
  // Empty if the device has none, and for a removed one.
  std::string manufacturer{};
  std::string product_name{};
  std::string serial{};

  friend bool operator==(const UsbDevice&, const UsbDevice&) = default;
};
/// "0403:cb48"
std::string ids_of(const UsbDevice& device);
/// "FALCON HAPTIC (0403:cb48) at 1-1.2"
std::string name_of(const UsbDevice& device);

/// Empty fields match all.
struct UsbDeviceFilter {
  std::optional<std::uint16_t> vendor{};
  std::optional<std::uint16_t> product{};
  std::string port_path{};  ///< empty: any
  bool matches(const UsbDevice& device) const noexcept;
};

/// One connection to libusb, for one user: a wait on it handles the events of everything that shares it. It
/// must outlive the objects made from it.
class UsbContext {
 public:
  /// @throws std::runtime_error if libusb cannot start; it needs no device and no permission for that.
  explicit UsbContext(SystemPaths paths = {});
  UsbContext(const UsbContext&) = delete;
  UsbContext& operator=(const UsbContext&) = delete;
  ~UsbContext();

  /// Ordered by bus and port. Empty: none found. If there are several of a kind, choose by port path.
  std::vector<UsbDevice> devices(const UsbDeviceFilter& filter = {}) const;

  const SystemPaths& paths() const noexcept { return paths_; }
  libusb_context* get() const noexcept { return context_; }
  /// All properties of one of this context's devices.
  UsbDevice inspect(libusb_device* device) const;

 private:
  SystemPaths paths_;
  libusb_context* context_ = nullptr;
};

/// The kernel's folder of the device.
std::filesystem::path sysfs_folder(const UsbDevice& device, const SystemPaths& paths);
/// The first line of a file, without its line end; empty if there is none.
std::string first_line(const std::filesystem::path& file);
/// The raw descriptors: the device's, then each configuration's. Empty if the device is gone.
std::vector<std::uint8_t> descriptors_of(const UsbDevice& device, const SystemPaths& paths);

struct UsbArrival {
  enum class Kind : std::uint8_t { kCame, kWent };
  Kind kind = Kind::kCame;
  UsbDevice device{};
};

/// Reports devices that arrive and leave, starting with those already present.
class UsbWatch {
 public:
  /// @throws std::runtime_error if this system does not support it.
  explicit UsbWatch(UsbDeviceFilter filter, SystemPaths paths = {});
  UsbWatch(const UsbWatch&) = delete;
  UsbWatch& operator=(const UsbWatch&) = delete;
  ~UsbWatch();

  /// Events since the last call, in order. Waits up to `timeout` for an event of any device (libusb rounds up
  /// to a millisecond); 0: does not wait.
  std::vector<UsbArrival> poll(std::chrono::nanoseconds timeout = {});

 private:
  struct Seen;
  UsbContext context_;
  std::unique_ptr<Seen> seen_;
};

}  // namespace drivers::usb
