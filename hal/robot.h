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
  /// Faster velocity commands are cut to it. A position is approached as fast as the drive is set to.
  double speed_limit_rad_per_s = std::numeric_limits<double>::infinity();
  /// What gear and links are made for; infinite where that is no less than the motor's limit. The drive does
  /// not keep it, in velocity and position mode least of all.
  double rated_torque_Nm = std::numeric_limits<double>::infinity();
  /// Whatever commands the joint keeps it within this range. Valid once the joint is homed.
  JointRange range{};
};

struct RobotCommand {
  /// Level, not event: false stops every motor, also one that its own watchdog made hold its place. After a
  /// fault the robot stays off until it has seen one exchange with `enable == false`, so motion never resumes
  /// by itself.
  bool enable = false;
  std::array<JointCommand, kMaxJoints> joints{};        ///< in the order of Robot::joints()
  std::array<GripperCommand, kMaxGrippers> grippers{};  ///< arm by arm; those there are not are ignored
};

struct RobotSample {
  /// Of the clock the robot was made with; when the values were taken, as well as is known.
  std::chrono::nanoseconds stamp{};
  /// For certain between these two. On a bus that is quick they lie apart by what a frame takes; where a busy
  /// machine holds up one of its ends, by that hold-up.
  std::chrono::nanoseconds earliest{};
  std::chrono::nanoseconds latest{};
  bool enabled = false;  ///< drives obey commands
  std::array<JointSample, kMaxJoints> joints{};
  std::array<GripperSample, kMaxGrippers> grippers{};
};
static_assert(std::is_trivially_copyable_v<RobotCommand> && std::is_trivially_copyable_v<RobotSample>);

/// What generic code can react to; `detail` keeps the backend's own code for the log.
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
  kFrameLoss,        ///< short gaps, each bridged, are too many; detail: of the last 1000 cycles how many
};

/// Outcome of one cycle. A fault is latched: it is reported in every cycle until the robot is disabled.
struct [[nodiscard]] CycleStatus {
  Fault fault = Fault::kNone;
  std::int8_t joint = -1;  ///< first joint concerned, -1 when the whole robot is
  std::uint32_t detail = 0;
  bool ok() const noexcept { return fault == Fault::kNone; }
  /// Of Fault::kJointFault.
  JointFault joint_fault() const noexcept { return static_cast<JointFault>(detail & 0xFF); }
};

/// Of the last 1000 cycles: those that were bridged because not all devices answered in time, and why.
struct BusLosses {
  int cycles = 0;      ///< all of them; the rest may overlap
  int lost = 0;        ///< no answer
  int damaged = 0;     ///< something came in that made no sense
  int incomplete = 0;  ///< an answer, but not of all devices
  int late = 0;        ///< answers that came after their cycle had given them up: of those lost
  int twice = 0;       ///< further answers to a cycle that had one
  /// More of them than the robot is set to warn of, or to stop at.
  enum class Level : std::uint8_t { kOk, kWarning, kFault } level = Level::kOk;
};

/// Between two positions of a joint, for every check of its sensors to run, and for any to (docs/safety.md,
/// "Sensors that lie").
inline constexpr std::chrono::microseconds kLongestRegularSample{1500};
inline constexpr std::chrono::milliseconds kLongestCheckedSample{20};
/// What Robot::notes() has to say of positions that come so far apart; nothing where all checks run.
std::vector<std::string> sampling_notes(std::chrono::nanoseconds interval);

/// In words, for messages: "a command that is not a finite number".
const char* describe(Fault fault) noexcept;
const char* describe(JointFault fault) noexcept;

/// Sole owner of its bus. One thread calls exchange(); of the set-up calls only explain(), losses(),
/// trouble() and report() may run beside it, in one other thread. Destruction deactivates.
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

  /// Cycle: sends `command`, fills `sample` with what the joints measured when the command reached them.
  /// On a fault the drives are off whatever the command says. When fresh values did not come back from all
  /// joints, the joints and the stamp are left as they were, so that the stamp shows their age.
  virtual CycleStatus exchange(const RobotCommand& command, RobotSample& sample) noexcept = 0;

  /// Setup, after activate(): what should be known of this robot before it moves, a remark a line, for the
  /// log.
  virtual std::vector<std::string> notes() const { return {}; }
  /// Setup: a status of exchange() in words, without its joint: what happened, and what to check.
  virtual std::string explain(const CycleStatus& status) const;
  /// Setup: none where there is no bus.
  virtual std::optional<BusLosses> losses() const { return std::nullopt; }
  /// Setup: what keeps it from working now, "DEVICE: what is wrong, and what to check", a device a line.
  virtual std::vector<std::string> trouble() const { return {}; }
  /// Setup: how the device fares in words, a finding a line, for the log after a run or a fault; after
  /// deactivate() what may still be moving, because nothing confirmed that it stopped. Empty when there is
  /// nothing to tell.
  virtual std::vector<std::string> report() const { return {}; }
};

}  // namespace hal
