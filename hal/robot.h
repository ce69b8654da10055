/// @file
/// One bus round trip per cycle for all joints of a robot.
///
/// Usage:
///   robot.activate();                                  // set-up: throws hal::SetupError
///   command.enable = true;
///   while (running) status = robot.exchange(command, sample);   // cycle: noexcept, 1 kHz
///   robot.deactivate();
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "hal/gripper.h"
#include "hal/joint.h"

namespace hal {

struct JointInfo {
  std::string name;            ///< "wheel-1", "arm-3": also the rig name in recordings
  double torque_limit_Nm = 0;  ///< what the motor's current limit can deliver
  /// Velocity commands are limited to it. In position mode the drive's own speed setting applies.
  double speed_limit_rad_per_s = std::numeric_limits<double>::infinity();
  /// Rating of gear and links; infinite if it is not below the motor's limit. The drive does not enforce it,
  /// least of all in velocity and position mode.
  double rated_torque_Nm = std::numeric_limits<double>::infinity();
  /// Every controller must keep the joint within this range. Valid once the joint is homed.
  JointRange range{};
};

struct RobotCommand {
  /// Level, not event: false stops every motor, including one whose own watchdog makes it hold its position.
  /// After a fault the robot stays off until one exchange with `enable == false`, so that motion never
  /// resumes by itself.
  bool enable = false;
  std::array<JointCommand, kMaxJoints> joints{};        ///< in the order of Robot::joints()
  std::array<GripperCommand, kMaxGrippers> grippers{};  ///< in the order of the arms; those of missing arms
                                                        ///< are ignored
};

struct RobotSample {
  /// Best estimate of when the values were measured, on the clock the robot was made with.
  std::chrono::nanoseconds stamp{};
  /// Guaranteed bounds of that time. On a fast bus they differ by the duration of a frame; if a busy machine
  /// delays one end, by that delay.
  std::chrono::nanoseconds earliest{};
  std::chrono::nanoseconds latest{};
  bool enabled = false;  ///< drives obey commands
  std::array<JointSample, kMaxJoints> joints{};
  std::array<GripperSample, kMaxGrippers> grippers{};
};
static_assert(std::is_trivially_copyable_v<RobotCommand> && std::is_trivially_copyable_v<RobotSample>);

/// Causes that generic code can react to; `detail` keeps the backend's own code for the log.
enum class Fault : std::uint8_t {
  kNone,
  kNotActive,        ///< exchange() before activate() or after deactivate()
  kBadCommand,       ///< a target was not finite; detail: the mode
  kJointFault,       ///< detail: the JointFault in the low byte, see CycleStatus::joint_fault()
  kFrameLost,        ///< no answer from the bus
  kPartialBus,       ///< some devices did not answer; detail: working counter
  kSimulatorSilent,  ///< no answer from a bus that says that youbot-sim emulates it
  kOtherMaster,      ///< another master commands the same bus
  kLinkDown,         ///< the interface takes no frames; detail: errno
  kFrameLoss,        ///< too many short gaps, each bridged; detail: number in the last 1000 cycles
};

/// Outcome of one cycle. A fault is latched: every cycle reports it until the robot is disabled.
struct [[nodiscard]] CycleStatus {
  Fault fault = Fault::kNone;
  std::int8_t joint = -1;  ///< first joint concerned; -1: the whole robot
  std::uint32_t detail = 0;
  bool ok() const noexcept { return fault == Fault::kNone; }
  /// For Fault::kJointFault.
  JointFault joint_fault() const noexcept { return static_cast<JointFault>(detail & 0xFF); }
};

/// Cycles in the last 1000 that were bridged because not all devices answered in time, by cause.
struct BusLosses {
  int cycles = 0;      ///< total; the causes may overlap
  int lost = 0;        ///< no answer
  int damaged = 0;     ///< an invalid frame was received
  int incomplete = 0;  ///< an answer, but not from all devices
  int late = 0;        ///< answers that arrived after their cycle's time-out: part of the lost ones
  int twice = 0;       ///< further answers to a cycle that already had one
  /// Compared with the robot's limits for a warning and for a fault.
  enum class Level : std::uint8_t { kOk, kWarning, kFault } level = Level::kOk;
};

/// A device on the bus, for a drawing of it.
struct BusDevice {
  std::string name;  ///< "slave 2 (KR-EC400)"
  bool answers = false;
  bool works = false;  ///< in operation
};

/// Maximum time between two positions of a joint for all sensor checks to run, and for any of them
/// (docs/safety.md, "Sensors that lie").
inline constexpr std::chrono::microseconds kLongestRegularSample{1500};
inline constexpr std::chrono::milliseconds kLongestCheckedSample{20};
/// Text for Robot::notes() about this sampling interval; empty if all checks run.
std::vector<std::string> sampling_notes(std::chrono::nanoseconds interval);

/// Text for messages: "a command that is not a finite number".
const char* describe(Fault fault) noexcept;
const char* describe(JointFault fault) noexcept;

/// Sole owner of its bus. One thread calls exchange(). Of the set-up calls, only joints(), explain(),
/// losses(), devices(), device_faults() and report() may run concurrently, in one other thread. The
/// destructor deactivates.
class Robot {
 public:
  Robot() = default;
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;
  virtual ~Robot() = default;

  /// Fixed from construction to destruction; at most kMaxJoints.
  virtual std::span<const JointInfo> joints() const noexcept = 0;

  /// Setup: bus up, drives answering, power off. Blocks, may take seconds.
  /// @throws hal::SetupError naming the device, the step and what to check.
  virtual void activate() = 0;
  /// Drives off, bus closed. Allowed in any state.
  virtual void deactivate() noexcept = 0;

  /// Cycle: sends `command`, fills `sample` with what the joints measured when the command reached them. On a
  /// fault the drives are off whatever the command says. If not all joints returned fresh values, joints and
  /// stamp keep their old values, so that the stamp shows their age.
  virtual CycleStatus exchange(const RobotCommand& command, RobotSample& sample) noexcept = 0;

  /// Setup, after activate(): remarks on this robot for the log, to be read before it moves, one per line.
  virtual std::vector<std::string> notes() const { return {}; }
  /// Setup: text for a status of exchange(), without its joint: what happened, and what to check.
  virtual std::string explain(const CycleStatus& status) const;
  /// Setup: empty if there is no bus.
  virtual std::optional<BusLosses> losses() const { return std::nullopt; }
  /// Setup: all devices in the order of the bus; empty if there is no bus.
  virtual std::vector<BusDevice> devices() const { return {}; }
  /// Setup: current faults that prevent operation, "DEVICE: what is wrong, and what to check", one device per
  /// line.
  virtual std::vector<std::string> device_faults() const { return {}; }
  /// Setup: condition of the device, one remark per line, for the log after a run or a fault; after
  /// deactivate() what may still be moving because no stop was confirmed. Empty if there is nothing to
  /// report.
  virtual std::vector<std::string> report() const { return {}; }
};

}  // namespace hal
