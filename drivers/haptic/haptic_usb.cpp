#include "drivers/haptic/haptic_usb.h"

#include <utility>
#include <vector>

#include "drivers/setup_error.h"
#include "drivers/usb/usb_access.h"

namespace drivers::haptic {
namespace {

SetupError as_error(usb::Refusal refusal) {
  return SetupError({std::move(refusal.device), std::move(refusal.step), std::move(refusal.expected),
                     std::move(refusal.found), std::move(refusal.hint)});
}

SetupError not_there(const usb::UsbContext& context, const usb::UsbDevice& wanted, const char* name) {
  const usb::AccessVerdict verdict = judge_access(absence_facts(context, wanted));
  const std::string where = wanted.port_path.empty() ? "on the USB bus" : "at USB port " + wanted.port_path;
  return SetupError({name, "look for it " + where, "a device", verdict.found, verdict.hint});
}

}  // namespace

std::unique_ptr<usb::UsbPort> open_falcon_port(usb::UsbContext& context, const std::string& port_path) {
  const auto found =
      context.devices({.vendor = kVendorFalcon, .product = kProductFalcon, .port_path = port_path});
  if (found.empty())
    throw not_there(context, {.vendor = kVendorFalcon, .product = kProductFalcon, .port_path = port_path},
                    "Novint Falcon");
  usb::LibusbPort::Opened opened = usb::LibusbPort::open(context, found.front(), kFalconPipes, kFalconRules);
  if (!opened.port) throw as_error(std::move(opened.refusal));
  return std::move(opened.port);
}

void check_force_dimension_on_bus(const usb::UsbContext& context) {
  const auto found = context.devices({.vendor = kVendorForceDimension});
  if (found.empty()) throw not_there(context, {.vendor = kVendorForceDimension}, "Force Dimension device");
  usb::AccessVerdict verdict;
  for (const usb::UsbDevice& device : found) {
    verdict = judge_access(collect_access_facts(context, device, 0, kForceDimensionRules));
    // The library takes a driver off, and tells best itself that another program has the device.
    if (verdict.access != usb::Access::kDenied && verdict.access != usb::Access::kNoNode) return;
  }
  throw SetupError({name_of(found.back()), "look at its USB node", "a node that this user may open",
                    verdict.found, verdict.hint});
}

}  // namespace drivers::haptic
