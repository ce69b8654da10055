/// @file
/// A HID device implemented by a program: the kernel's uhid takes its descriptor and its reports, and passes
/// on what programs write to it. To the kernel it is a hidraw node like any other. Source: the kernel's
/// Documentation/hid/uhid.rst. Needs root.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <thread>
#include <vector>

namespace guest {

enum class HidBus : std::uint16_t { kUsb = 3, kBluetooth = 5 };  ///< numbers of linux/input.h

struct HidIdentity {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  HidBus bus = HidBus::kUsb;
};

class UhidDevice {
 public:
  /// Plugs it in; the kernel has it slightly later. `on_output` gets each output report, with its number
  /// first; it is called by the device's own thread.
  /// @throws std::runtime_error if there is no uhid.
  UhidDevice(const HidIdentity& identity, std::span<const std::uint8_t> report_descriptor,
             std::function<void(std::span<const std::uint8_t>)> on_output);
  UhidDevice(const UhidDevice&) = delete;
  UhidDevice& operator=(const UhidDevice&) = delete;
  /// Unplugs it, and waits for udev to forget it.
  ~UhidDevice();

  /// Any thread.
  void send(std::span<const std::uint8_t> report);
  /// Unplugs the cable.
  void unplug();

 private:
  void serve(const std::stop_token& stop);

  int uhid_;
  std::function<void(std::span<const std::uint8_t>)> on_output_;
  std::jthread thread_;
};

}  // namespace guest
