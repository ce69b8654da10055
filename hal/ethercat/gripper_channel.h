/// @file
/// One gripper of the EtherCAT robot. It has no process data: telegrams through the mailbox of the arm's last
/// joint move it, independent of that joint's motion.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/tmcl/gripper.h"
#include "hal/ethercat/drive_channel.h"
#include "hal/gripper.h"

namespace hal {

/// Never stops the arm. Cycle: all of it.
class GripperChannel {
 public:
  /// @param hand the drive that the gripper is connected to; must outlive the channel
  GripperChannel(DriveChannel& hand, bool present, std::chrono::nanoseconds period) noexcept;

  std::size_t slave() const noexcept { return hand_.slave(); }
  /// Once per cycle, after DriveChannel::serve_mailbox(). If not enabled, or after a failure, its motors are
  /// stopped: until they acknowledge, the state stays kMoving.
  void step(const GripperCommand& command, bool enabled) noexcept;
  /// Its power may have been off, and pending requests are lost: it is stopped again if it may be moving, and
  /// its closed position has to be found again. Call once when the restoring of its drive begins.
  void forget() noexcept;
  GripperSample sample() const noexcept { return sample_; }

 private:
  void begin(drivers::tmcl::Sequence& sequence) noexcept;
  void run_sequence() noexcept;
  void stop(GripperState afterwards) noexcept;

  DriveChannel& hand_;
  drivers::tmcl::GripperConfig config_;
  std::chrono::nanoseconds period_;
  std::optional<drivers::tmcl::GripperCalibration> calibration_;
  std::optional<drivers::tmcl::GripperMotion> motion_;
  std::optional<drivers::tmcl::GripperStop> stop_;
  GripperState after_stop_ = GripperState::kIdle;
  drivers::tmcl::Sequence* running_ = nullptr;
  std::uint32_t tag_ = DriveChannel::kOwnTags;
  std::optional<std::int32_t> goal_;  // microsteps per bar
  bool calibrated_ = false;
  GripperSample sample_;
};

}  // namespace hal
