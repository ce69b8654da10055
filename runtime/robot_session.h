/// @file
/// What every run of a robot's loop begins and ends with.
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

/// Force off however the session ends. What nothing confirmed is said.
class HapticActivation {
 public:
  explicit HapticActivation(hal::HapticDevice& device) : device_(device) { device_.activate(); }
  HapticActivation(const HapticActivation&) = delete;
  HapticActivation& operator=(const HapticActivation&) = delete;
  ~HapticActivation();

 private:
  hal::HapticDevice& device_;
};

/// What the system refuses. @throws hal::SetupError with all of it, unless that is allowed.
std::vector<std::string> enter_real_time(RealTimeThread& thread, const RealTimeConfig& config,
                                         bool allow_non_real_time);

/// Writes the report on a fault: beside the recording where there is one, so that a lab finds both; if that
/// cannot be written or there is none, into youbotd-faults-USER where temporary files live, a folder of this
/// user's own in which the newest 20 are kept. Never over another file, and through no link. `write(path)`
/// writes the cycles; `frames` may be null. Empty when it could not be written anywhere; why goes to
/// `problems`.
std::optional<std::filesystem::path> write_fault_report(
    const std::optional<std::filesystem::path>& record_directory,
    const std::function<void(const std::filesystem::path&)>& write, const drivers::ethercat::PcapRing* frames,
    const std::string& reason, std::vector<std::string>& problems);

}  // namespace runtime
