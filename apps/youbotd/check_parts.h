/// @file
/// The parts of `youbotd --check`. Nothing moves, no device changes its state, and nothing is sent to a
/// haptic device.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "drivers/ethercat/link.h"
#include "drivers/tmcl/youbot_kind.h"
#include "drivers/usb/system_paths.h"
#include "runtime/open_haptic.h"
#include "runtime/recording/recording_directory.h"

namespace youbotd {

/// One line of `youbotd --check`.
struct Finding {
  enum class Mark : std::uint8_t {
    kOk,
    kWarn,  ///< youbotd runs, but with limitations
    kFail,  ///< it does not run, or not as configured
  };
  Mark mark = Mark::kOk;
  std::string found{};   ///< "clock source: tsc"
  std::string remedy{};  ///< a command to type if there is one; empty: nothing to do
};
using Findings = std::vector<Finding>;

// check_machine.cpp: whether the kernel of this machine suits a 1 kHz loop. All data comes from files, whose
// directories are parameters.

/// Whether the kernel is fully preemptible.
Finding check_kernel(const drivers::usb::SystemPaths& paths);

/// Duration of reading the clock, which the loop does several times per cycle.
Finding check_clock_source(const drivers::usb::SystemPaths& paths);

/// The share of the time that the kernel leaves to real-time threads. `busy_wait`: the loop occupies a whole
/// core.
Finding check_throttling(bool busy_wait, const drivers::usb::SystemPaths& paths);

/// Whether the cores keep their frequency while the loop sleeps: the loop's core, or all if it is not pinned.
/// Empty if the kernel does not change it.
std::optional<Finding> check_governor(std::optional<int> cpu, const drivers::usb::SystemPaths& paths);

// check_rights.cpp: the permissions of this process, by trying.

/// The command that gives this program, and its users, all permissions that it needs.
std::string how_to_give_rights();

/// Locks the present memory, and unlocks it again. `refused`: severity of a refusal.
Finding check_memory_lock(Finding::Mark refused);

/// Takes SCHED_FIFO in its own thread. `who`: "the cycle".
Finding check_priority(const std::string& who, int priority, Finding::Mark refused);

/// Pins its own thread to that core.
Finding check_core(int cpu, Finding::Mark refused);

// check_bus.cpp: whether a network interface is the robot's EtherCAT bus.

/// From the kernel's files.
Finding check_interface(const std::string& interface, const drivers::usb::SystemPaths& paths);

/// Whether it carries other traffic: addresses of this machine on it.
Finding check_addresses(const std::string& interface);

/// Opens it like the EtherCAT master, listens for another master, and then reads which devices are there.
Findings check_raw_socket(const std::string& interface, drivers::tmcl::YoubotKind kind);

/// Which devices are on the bus: names the first that is missing or foreign. They get a station address and
/// their EEPROMs are read; their states and outputs stay the same.
Finding check_devices(drivers::ethercat::Link& link, drivers::tmcl::YoubotKind kind);

// check_master.cpp: whether the configured haptic device is present and usable.

/// For a device known to runtime::open_haptic(). Empty for the simulated one.
Findings check_master(const runtime::HapticOptions& options, const drivers::usb::SystemPaths& paths);

// check_link.cpp: key and address of a station. Sends nothing.

/// Empty with one computer for both.
Findings check_link(runtime::Role role, const runtime::LinkOptions& link);

// check_recording.cpp: whether a run can be recorded in its directory.

/// Writes a file in `directory`, or where it would be created, and removes it again. `holds_recording`: there
/// is an earlier recording, which is never replaced.
Finding check_recording(const std::filesystem::path& directory, bool holds_recording,
                        std::chrono::nanoseconds period, runtime::RecordingFormat format);

/// For a disk with this many free bytes.
Finding check_room(const std::filesystem::path& directory, double free_bytes, std::chrono::nanoseconds period,
                   runtime::RecordingFormat format);

// check_service.cpp: whether clients can reach youbotd. Serves for a moment without answering.

/// Replaces a socket that a dead daemon left.
/// @throws std::invalid_argument if the path is too long for a socket.
Finding check_control(const std::filesystem::path& socket);

/// `where`: as of live::WebServer. @throws std::invalid_argument for another one.
Finding check_page(const std::string& where);

/// Joins the DDS domain for a moment, as `--ros2` does.
Finding check_ros2(std::uint32_t domain);

}  // namespace youbotd
