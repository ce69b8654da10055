/// @file
/// The haptic devices on the USB bus: their ids, and the way from the bus to an open device. Setup:
/// everything.
#pragma once
#include <cstdint>
#include <memory>
#include <string>

#include "drivers/usb/libusb_port.h"
#include "drivers/usb/usb_devices.h"
#include "drivers/usb/usb_port.h"

namespace drivers::haptic {

/// Of all its devices: which one it is the vendor's library tells, and no descriptor. Source: chai3d and
/// sawForceDimensionSDK.
inline constexpr std::uint16_t kVendorForceDimension = 0x1451;
inline constexpr const char* kForceDimensionRules = "60-force-dimension.rules";

/// Source: libnifalcon.
inline constexpr std::uint16_t kVendorFalcon = 0x0403;
inline constexpr std::uint16_t kProductFalcon = 0xcb48;
inline constexpr usb::UsbPipes kFalconPipes{.interface = 0, .out = 0x02, .in = 0x81};
inline constexpr const char* kFalconRules = "60-novint-falcon.rules";

/// The Falcon at this socket, or the first one when that is empty. `context` outlives the port and belongs to
/// it alone. @throws SetupError saying what to do: not on the bus, no access, in use.
std::unique_ptr<usb::UsbPort> open_falcon_port(usb::UsbContext& context, const std::string& port_path = {});

/// The vendor's library only says "no device". @throws SetupError when the bus tells more: none there, or
/// none that this user may open. Opens and claims nothing.
void check_force_dimension_on_bus(const usb::UsbContext& context);

}  // namespace drivers::haptic
