/// @file
/// Why a supervisor stopped its task: stored as plain values by the cycle and turned into text afterwards.
#pragma once
#include <chrono>
#include <cstdint>
#include <string>

#include "hal/haptic_device.h"
#include "hal/robot.h"

namespace runtime {

/// Only the first reason of a run is kept.
struct StopReason {
  enum class Kind : std::uint8_t {
    kNone,
    // Detected by the supervisor.
    kRobotFault,  ///< see `status`
    kNotEnabled,  ///< the drives did not start to obey within `value` s
    kNotObeying,  ///< the drives switched off by themselves
    kStalled,     ///< this program did not run for `value` s
    kNotAtRest,   ///< after braking for `limit` s a joint still turns at `value` rad/s
    // Detected by a task, which provides the text.
    kCommandTimeout,  ///< set-points stopped coming
    kOverspeed,       ///< `joint` turned faster than allowed
    kBehind,          ///< too far from the reference
    kTurnedBehind,    ///< likewise in rotation
    kOutside,         ///< outside the workspace
    kTooFar,          ///< `joint` moved further than allowed
    kNearStop,        ///< `joint` came too near the end of its range
    kTorque,          ///< `joint` took more torque than its rating
    kBlocked,         ///< `joint` is pushed and does not move
    kNotPlaced,       ///< `joint` did not reach its start position
    kNotInTime,       ///< it did not get ready in time
    kMisfit,          ///< the task does not fit the robot; nothing moved
    kMasterFault,     ///< see `master`
  };
  Kind kind = Kind::kNone;
  /// For reasons detected by a task: a constant format string with {joint}, {value}, {limit} and {master}.
  const char* text = nullptr;
  int joint = -1;      ///< of hal::Robot::joints()
  double value = 0.0;  ///< the excessive value
  double limit = 0.0;
  hal::CycleStatus status{};
  hal::HapticStatus master{};
  // Set by the supervisor.
  std::uint64_t cycle = 0;
  std::chrono::nanoseconds time{};   ///< since the first cycle, as in the recording
  std::chrono::nanoseconds pause{};  ///< of this program, just before
  explicit operator bool() const noexcept { return kind != Kind::kNone; }
};

/// "wheel-2 turned at 14.1 rad/s, more than allowed (limits.wheel_speed_rad_per_s = 12); drives switched
/// off".
/// `master`: the haptic device of a task with one.
std::string what(const StopReason& reason, const hal::Robot& robot,
                 const hal::HapticDevice* master = nullptr);
/// The same, followed by what switched the drives off before they came to rest, if anything did.
std::string what(const StopReason& reason, const StopReason& cut_short_by, const hal::Robot& robot,
                 const hal::HapticDevice* master = nullptr);
/// "cycle 1200 (1.199 s): " and what().
std::string describe(const StopReason& reason, const hal::Robot& robot,
                     const hal::HapticDevice* master = nullptr);
std::string describe(const StopReason& reason, const StopReason& cut_short_by, const hal::Robot& robot,
                     const hal::HapticDevice* master = nullptr);

}  // namespace runtime
