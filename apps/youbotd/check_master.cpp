#include "apps/youbotd/check_parts.h"

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "drivers/haptic/force_dimension_library.h"
#include "drivers/haptic/haptic_usb.h"
#include "drivers/haptic/space_mouse_setup.h"
#include "drivers/setup_error.h"
#include "drivers/usb/usb_access.h"
#include "drivers/usb/usb_devices.h"

namespace youbotd {
namespace {

namespace haptic = drivers::haptic;
namespace usb = drivers::usb;
using Mark = Finding::Mark;

/// Result of `look`, or the reason why it failed.
Finding finding_of(const std::string& what, const std::function<Finding()>& look) {
  try {
    return look();
  } catch (const drivers::SetupError& error) {
    return {Mark::kFail, what + ": " + error.report().found, error.report().hint};
  } catch (const std::runtime_error& error) {
    return {Mark::kFail, what + ": " + error.what(), "lsusb shows what the kernel sees"};
  }
}

Finding check_falcon(const std::string& port_path, const usb::SystemPaths& paths) {
  const usb::UsbContext context(paths);
  const usb::UsbDeviceFilter falcon{
      .vendor = haptic::kVendorFalcon, .product = haptic::kProductFalcon, .port_path = port_path};
  const std::vector<usb::UsbDevice> found = context.devices(falcon);
  const usb::AccessVerdict verdict = judge_access(
      found.empty() ? absence_facts(context, {.vendor = haptic::kVendorFalcon,
                                              .product = haptic::kProductFalcon,
                                              .port_path = port_path})
                    : collect_access_facts(context, found.front(), haptic::kFalconPipes.interface,
                                           haptic::kFalconRules));
  // A kernel driver is detached when the port is opened.
  const bool usable = verdict.access == usb::Access::kFree || verdict.access == usb::Access::kDriverBound;
  return {usable ? Mark::kOk : Mark::kFail, "Novint Falcon: " + verdict.found, usable ? "" : verdict.hint};
}

Finding check_force_dimension_library(const runtime::HapticOptions& options) {
  if (options.force_dimension.transport == hal::ForceDimensionTransport::kUsb)
    return {Mark::kFail, "Force Dimension SDK: not to be used, and without it there is no way to the device",
            "set haptic.force_dimension.transport = \"sdk\""};
  const haptic::ForceDimensionLibrary library(options.force_dimension.sdk);
  return {Mark::kOk, "Force Dimension SDK: " + library.path() + ", " + to_string(library.version())};
}

Finding check_space_mouse(const haptic::SpaceMouseChoice& choice, const usb::SystemPaths& paths) {
  const haptic::HidapiUse hidapi;
  const haptic::SpaceMouseInfo mouse = choose_space_mouse(choice, haptic::find_space_mice(paths));
  (void)haptic::open_space_mouse(mouse);
  return {Mark::kOk, "SpaceMouse: " + describe(mouse) + " opens"};
}

}  // namespace

Findings check_master(const runtime::HapticOptions& options, const usb::SystemPaths& paths) {
  if (options.name == "falcon")
    return {finding_of("Novint Falcon", [&] { return check_falcon(options.falcon.port_path, paths); })};
  if (options.name == "spacemouse")
    return {finding_of("SpaceMouse", [&] { return check_space_mouse(options.space_mouse.choice, paths); })};
  if (runtime::is_force_dimension(options.name))
    return {finding_of("Force Dimension SDK", [&] { return check_force_dimension_library(options); }),
            finding_of("Force Dimension device", [&] {
              haptic::check_force_dimension_on_bus(usb::UsbContext(paths));
              return Finding{Mark::kOk, "Force Dimension device: there, and may be opened"};
            })};
  return {};
}

}  // namespace youbotd
