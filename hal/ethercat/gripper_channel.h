/// @file
/// One gripper of the EtherCAT robot. It has no process data: it is moved by telegrams through the mailbox of
/// the arm's last joint, beside whatever that joint does.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/tmcl/gripper.h"
#include "hal/ethercat/drive_channel.h"
#include "hal/gripper.h"

namespace hal {

/// Nothing here ever stops the arm. Cycle: all of it.
class GripperChannel {
 public:
  /// @param hand the drive behind which it is; outlives the channel
  GripperChannel(DriveChannel& hand, bool present, std::chrono::nanoseconds period) noexcept;

  std::size_t slave() const noexcept { return hand_.slave(); }
  /// Once a cycle, after DriveChannel::serve_mailbox(). Not enabled, or when it fails, its motors are
  /// stopped: until they answer that they have heard it, the state stays kMoving.
  void step(const GripperCommand& command, bool enabled) noexcept;
  /// Its power may have been off, and what was asked of it is lost: it is stopped anew if it may be moving,
  /// and where closed is has to be asked again. Once when the hand's restoring begins.
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
