/// @file
/// Common start and end of every run of a robot's loop.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/ethercat/pcap_ring.h"
#include "hal/clock.h"
#include "hal/haptic_device.h"
#include "hal/robot.h"
#include "runtime/real_time.h"

namespace runtime {

/// Virtual, or the machine's steady one.
std::unique_ptr<hal::Clock> make_clock(bool virtual_time);

/// Logs the robot's notes, and switches it off however the session ends.
class RobotActivation {
 public:
  explicit RobotActivation(hal::Robot& robot);
  RobotActivation(const RobotActivation&) = delete;
  RobotActivation& operator=(const RobotActivation&) = delete;
  ~RobotActivation() { robot_.deactivate(); }

 private:
  hal::Robot& robot_;
};

/// Switches the force off however the session ends. Logs if this is unconfirmed.
class HapticActivation {
 public:
  explicit HapticActivation(hal::HapticDevice& device) : device_(device) { device_.activate(); }
  HapticActivation(const HapticActivation&) = delete;
  HapticActivation& operator=(const HapticActivation&) = delete;
  ~HapticActivation();

 private:
  hal::HapticDevice& device_;
};

/// Returns what the system refuses. @throws hal::SetupError with all of it, in the name of `program`, unless
/// that is allowed.
std::vector<std::string> enter_real_time(RealTimeThread& thread, const RealTimeConfig& config,
                                         bool allow_non_real_time, const std::string& program = "youbotd");

/// Writes the fault report next to the recording if there is one. If that fails, or without a recording, it
/// goes to youbotd-faults-USER in the directory for temporary files, a folder of this user in which the
/// newest 20 are kept. Never overwrites a file, and follows no link. `write(path)` writes the cycles;
/// `frames` may be null. Empty if it could not be written anywhere; the reasons go to `problems`.
std::optional<std::filesystem::path> write_fault_report(
    const std::optional<std::filesystem::path>& record_directory,
    const std::function<void(const std::filesystem::path&)>& write, const drivers::ethercat::PcapRing* frames,
    const std::string& reason, std::vector<std::string>& problems);

}  // namespace runtime
