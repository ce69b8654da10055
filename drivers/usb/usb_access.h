/// @file
/// Explains why a USB device cannot be used, with advice. Facts are collected in one function and judged in
/// another, so that each message can be tested without its cause. Setup: everything. Nothing is opened, sent
/// or changed; what cannot be read counts as absent.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/usb/system_paths.h"
#include "drivers/usb/usb_devices.h"

namespace drivers::usb {

/// The parts of a SetupError, which the layer above throws: "DEVICE: STEP: expected E, found F; HINT".
struct Refusal {
  std::string device{};
  std::string step{};
  std::string expected{};
  std::string found{};
  std::string hint{};
};

/// A process that has the device's node open.
struct NodeHolder {
  int pid = 0;
  std::string command{};
  bool is_this_process = false;
};

struct AccessFacts {
  UsbDevice device{};
  bool on_bus = false;
  std::vector<std::string> same_vendor{};  ///< names of the vendor's devices that are present

  std::string node{};              ///< /dev/bus/usb/BBB/DDD
  bool node_folder_there = false;  ///< /dev/bus/usb
  bool node_there = false;
  bool may_use_node = false;  ///< read and write, by access(2)
  unsigned node_mode = 0;     ///< permission bits
  std::string node_owner{};
  std::string node_group{};

  std::string user{};
  bool in_group = false;          ///< this process, in the node's group
  bool listed_in_group = false;   ///< the user, by the group database
  std::string rules_file{};       ///< such as 60-novint-falcon.rules; empty: no file is known for the device
  std::string rules_installed{};  ///< its path; empty: not installed

  int interface = 0;
  std::string driver{};  ///< kernel driver bound to the interface; usbfs: a program has claimed it
  bool claim_refused = false;
  std::vector<NodeHolder> holders{};
  bool all_processes_seen = false;  ///< else some belong to other users
};

/// `rules_file`: name of the udev rules that give access to such a device; empty if there are none.
AccessFacts collect_access_facts(const UsbContext& context, const UsbDevice& device, int interface,
                                 const std::string& rules_file);
/// The same for a device that was not found.
AccessFacts absence_facts(const UsbContext& context, const UsbDevice& wanted);

enum class Access : std::uint8_t {
  kFree,
  kNotOnBus,
  kNoNode,
  kDenied,
  kDriverBound,  ///< detached while a port is open, unless the kernel refuses
  kInUse,
};

struct AccessVerdict {
  Access access = Access::kFree;
  std::string found{};
  std::string hint{};  ///< empty if free
};
AccessVerdict judge_access(const AccessFacts& facts);

/// The kernel driver bound to an interface; empty if none.
std::string kernel_driver_of(const UsbDevice& device, int interface, const SystemPaths& paths);

}  // namespace drivers::usb
