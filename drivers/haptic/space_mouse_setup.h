/// @file
/// Which SpaceMouse there is, and how it is opened: everything before the first report. All of it blocks,
/// allocates and may be called from any thread; SpaceMouse (space_mouse.h) is what calls it.
#pragma once
#include <hidapi/hidapi.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/setup_error.h"
#include "drivers/usb/system_paths.h"

namespace drivers::haptic {

/// hidapi is initialised as long as one of these lives, so that several devices of one process do not end it
/// under each other.
class HidapiUse {
 public:
  HidapiUse();
  HidapiUse(const HidapiUse&) = delete;
  HidapiUse& operator=(const HidapiUse&) = delete;
  ~HidapiUse();
};

struct SpaceMouseInfo {
  std::string model = {};   ///< "SpaceNavigator"
  std::string path = {};    ///< "/dev/hidraw3"
  std::string serial = {};  ///< most models have none: empty
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  /// What an operator should know.
  std::vector<std::string> warnings = {};
};
/// "SpaceNavigator (/dev/hidraw3)"
std::string describe(const SpaceMouseInfo& mouse);

/// Empty: whichever; both: it has to be this one.
struct SpaceMouseChoice {
  std::string serial = {};
  std::string path = {};
};

/// Those that are connected, by path; empty: none. Of devices that show several HID nodes (a receiver also
/// brings a keyboard and a mouse) only the node of the axes. Nothing is sent to any device, or opened.
/// @throws SetupError when sysfs cannot be read.
std::vector<SpaceMouseInfo> find_space_mice(const usb::SystemPaths& paths = {});

/// The first that fits. @throws SetupError telling what is there instead.
SpaceMouseInfo choose_space_mouse(const SpaceMouseChoice& choice, const std::vector<SpaceMouseInfo>& found);

struct HidNodeFacts {
  int error = 0;      ///< errno of opening it
  unsigned mode = 0;  ///< permission bits; 0: not known
  std::string owner = {};
  std::string group = {};
};
/// What is to be done about a node that does not open.
SetupError node_refused(const SpaceMouseInfo& mouse, const HidNodeFacts& facts);

struct HidClose {
  void operator()(hid_device* device) const noexcept { hid_close(device); }
};
using HidDevice = std::unique_ptr<hid_device, HidClose>;

/// While a HidapiUse lives. @throws SetupError see node_refused().
HidDevice open_space_mouse(const SpaceMouseInfo& mouse);

}  // namespace drivers::haptic
