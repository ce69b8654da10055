#include "drivers/usb/usb_devices.h"

#include <libusb-1.0/libusb.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "drivers/usb/libusb_time.h"

namespace drivers::usb {
namespace {

constexpr int kDeepest = 7;  // tiers of hubs that USB allows

std::string port_path_of(libusb_device* device) {
  std::array<std::uint8_t, kDeepest> ports{};
  const int depth = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  const std::string bus = std::to_string(libusb_get_bus_number(device));
  if (depth <= 0) return "usb" + bus;
  std::string path = bus;
  for (int i = 0; i < depth; ++i)
    path += (i == 0 ? "-" : ".") + std::to_string(ports[static_cast<std::size_t>(i)]);
  return path;
}

UsbSpeed speed_of(libusb_device* device) noexcept {
  switch (libusb_get_device_speed(device)) {
    case LIBUSB_SPEED_LOW: return UsbSpeed::kLow;
    case LIBUSB_SPEED_FULL: return UsbSpeed::kFull;
    case LIBUSB_SPEED_HIGH: return UsbSpeed::kHigh;
    case LIBUSB_SPEED_SUPER: return UsbSpeed::kSuper;
    case LIBUSB_SPEED_SUPER_PLUS: return UsbSpeed::kSuperPlus;
    default: return UsbSpeed::kUnknown;
  }
}

/// Properties that libusb itself knows, even of a device that is gone.
UsbDevice without_strings(libusb_device* device) {
  UsbDevice found;
  libusb_device_descriptor descriptor{};
  if (libusb_get_device_descriptor(device, &descriptor) == 0) {
    found.vendor = descriptor.idVendor;
    found.product = descriptor.idProduct;
  }
  found.bus = libusb_get_bus_number(device);
  found.address = libusb_get_device_address(device);
  found.port_path = port_path_of(device);
  found.speed = speed_of(device);
  return found;
}

}  // namespace

const char* describe(UsbSpeed speed) noexcept {
  switch (speed) {
    case UsbSpeed::kUnknown: return "speed unknown";
    case UsbSpeed::kLow: return "low speed, 1.5 Mbit/s";
    case UsbSpeed::kFull: return "full speed, 12 Mbit/s";
    case UsbSpeed::kHigh: return "high speed, 480 Mbit/s";
    case UsbSpeed::kSuper: return "super speed, 5 Gbit/s";
    case UsbSpeed::kSuperPlus: return "super speed plus, 10 Gbit/s";
  }
  return "speed unknown";
}

std::string ids_of(const UsbDevice& device) {
  std::array<char, 10> text{};
  (void)std::snprintf(text.data(), text.size(), "%04x:%04x", static_cast<unsigned>(device.vendor),
                      static_cast<unsigned>(device.product));
  return text.data();
}

std::string name_of(const UsbDevice& device) {
  const std::string ids = ids_of(device);
  const std::string name = device.product_name.empty() ? ids : device.product_name + " (" + ids + ")";
  return device.port_path.empty() ? name : name + " at " + device.port_path;
}

bool UsbDeviceFilter::matches(const UsbDevice& device) const noexcept {
  return (!vendor || *vendor == device.vendor) && (!product || *product == device.product) &&
         (port_path.empty() || port_path == device.port_path);
}

std::filesystem::path sysfs_folder(const UsbDevice& device, const SystemPaths& paths) {
  return paths.sys / "bus/usb/devices" / device.port_path;
}

std::string first_line(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

std::vector<std::uint8_t> descriptors_of(const UsbDevice& device, const SystemPaths& paths) {
  std::ifstream stream(sysfs_folder(device, paths) / "descriptors", std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

UsbContext::UsbContext(SystemPaths paths) : paths_(std::move(paths)) {
  const int error = libusb_init(&context_);
  if (error == 0) return;
  throw std::runtime_error(std::string("USB: start libusb: expected success, found ") +
                           libusb_error_name(error) +
                           "; check that udev runs and that this process may open more files");
}

UsbContext::~UsbContext() { libusb_exit(context_); }

UsbDevice UsbContext::inspect(libusb_device* device) const {
  UsbDevice found = without_strings(device);
  const std::filesystem::path folder = sysfs_folder(found, paths_);
  // Another device may be there by now.
  if (first_line(folder / "devnum") != std::to_string(found.address)) return found;
  found.manufacturer = first_line(folder / "manufacturer");
  found.product_name = first_line(folder / "product");
  found.serial = first_line(folder / "serial");
  return found;
}

std::vector<UsbDevice> UsbContext::devices(const UsbDeviceFilter& filter) const {
  libusb_device** list = nullptr;
  const auto count = libusb_get_device_list(context_, &list);
  std::vector<UsbDevice> found;
  for (auto i = 0; i < count; ++i) {
    if (filter.matches(without_strings(list[i]))) found.push_back(inspect(list[i]));
  }
  if (count >= 0) libusb_free_device_list(list, 1);
  std::ranges::sort(found, [](const UsbDevice& a, const UsbDevice& b) {
    return std::tie(a.bus, a.port_path) < std::tie(b.bus, b.port_path);
  });
  return found;
}

/// libusb's callback may hardly call libusb, so it only stores the event.
struct UsbWatch::Seen {
  struct Note {
    UsbArrival::Kind kind;
    libusb_device* device;
  };
  UsbDeviceFilter filter;
  libusb_hotplug_callback_handle handle = 0;
  std::vector<Note> notes;
};

UsbWatch::UsbWatch(UsbDeviceFilter filter, SystemPaths paths)
    : context_(std::move(paths)), seen_(std::make_unique<Seen>()) {
  seen_->filter = std::move(filter);
  const auto note = [](libusb_context*, libusb_device* device, libusb_hotplug_event event,
                       void* user) noexcept -> int {
    Seen& seen = *static_cast<Seen*>(user);
    const bool came = event == LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED;
    seen.notes.push_back(
        {came ? UsbArrival::Kind::kCame : UsbArrival::Kind::kWent, libusb_ref_device(device)});
    return 0;
  };
  const auto id = [](const std::optional<std::uint16_t>& wanted) {
    return wanted ? static_cast<int>(*wanted) : LIBUSB_HOTPLUG_MATCH_ANY;
  };
  const int error =
      libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) == 0
          ? LIBUSB_ERROR_NOT_SUPPORTED
          : libusb_hotplug_register_callback(
                context_.get(), LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT,
                LIBUSB_HOTPLUG_ENUMERATE, id(seen_->filter.vendor), id(seen_->filter.product),
                LIBUSB_HOTPLUG_MATCH_ANY, note, seen_.get(), &seen_->handle);
  if (error != 0) {
    throw std::runtime_error(std::string("USB: watch devices: expected success, found ") +
                             libusb_error_name(error) + "; look for devices with devices() instead");
  }
}

UsbWatch::~UsbWatch() {
  libusb_hotplug_deregister_callback(context_.get(), seen_->handle);
  for (const Seen::Note& note : seen_->notes) libusb_unref_device(note.device);
}

std::vector<UsbArrival> UsbWatch::poll(std::chrono::nanoseconds timeout) {
  timeval wait = libusb_time(seen_->notes.empty() ? timeout : std::chrono::nanoseconds(0));
  (void)libusb_handle_events_timeout_completed(context_.get(), &wait, nullptr);
  std::vector<UsbArrival> arrivals;
  for (const Seen::Note& note : std::exchange(seen_->notes, {})) {
    // The folder of a removed device may belong to another one by now.
    UsbArrival arrival{note.kind, note.kind == UsbArrival::Kind::kCame ? context_.inspect(note.device)
                                                                       : without_strings(note.device)};
    libusb_unref_device(note.device);
    if (seen_->filter.matches(arrival.device)) arrivals.push_back(std::move(arrival));
  }
  return arrivals;
}

}  // namespace drivers::usb
