/// @file
/// The youBot over EtherCAT.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/tmcl/youbot_kind.h"
#include "hal/clock.h"
#include "hal/robot.h"

namespace drivers::ethercat {
class FrameTap;
class Link;
}  // namespace drivers::ethercat

namespace hal {

using drivers::tmcl::YoubotKind;

inline constexpr int kToleratedCycles = 10;
/// Equal to the boards' own watchdog.
inline constexpr std::chrono::milliseconds kSimulatorPatience{100};

struct EthercatOptions {
  YoubotKind kind = YoubotKind::kBaseAndArm;
  /// Poll the network interface instead of sleeping on it: faster, but occupies the core.
  bool busy_wait = false;
  /// The motor controllers report only the current's magnitude (depends on the firmware).
  bool unsigned_current = false;
  /// Cycles without an answer, or with slaves missing, that are bridged with the last sample. Default:
  /// kToleratedCycles. On a bus on which every slave's EEPROM says that youbot-sim emulates it, cycles
  /// without an answer are bridged for kSimulatorPatience instead.
  std::optional<int> tolerated_cycles{};
  /// Shares of the last 1000 cycles that were bridged. Above the first: a warning, reported by
  /// device_faults() and losses(). Above the second: a fault. One longest bridge alone must stay below it.
  double loss_warning = 0.02;
  double loss_fault = 0.2;
  /// Time-out for the answer of a cycle. Less than a period on a robot; longer for slaves that a busy machine
  /// emulates without real-time demands.
  std::chrono::nanoseconds frame_timeout = std::chrono::microseconds(500);
  /// Synchronise the slaves' clocks to one reference. The youBot's boards reportedly do not support it.
  bool distributed_clocks = false;
  /// Arm joints without a known zero find it at their end stops when the robot is enabled: the arm MOVES, all
  /// joints at once. Fold it by hand first.
  bool home_arms = false;
  /// Written to the drives at start-up, and again after a drive lost power. Not stored in EEPROM.
  struct Parameter {
    std::string joint{};  ///< "wheel-1"
    std::string name{};   ///< as youbot-bench parameters lists it
    std::int32_t value = 0;
  };
  std::vector<Parameter> parameters{};
  /// Receives every frame, for example a ring buffer written after a fault; must outlive the robot. Null:
  /// none.
  drivers::ethercat::FrameTap* tap = nullptr;
};

/// Joints in bus order: wheel-1 … wheel-4, arm-1 … arm-5, arm2-1 … arm2-5 (those that the kind has).
///
/// - activate() scans, compares with the expected topology, reads the firmware versions and takes all slaves
///   to OP. A base with one or two arms can also be used as a base, and one with two arms as a base with one:
///   the drives of the unused arm, and its gripper, stay off in PRE-OP, and notes() says so.
/// - A sample's stamp is taken as soon as its frame has been sent: the frame then passes the boards, which
///   insert their latest measurements. The stamp excludes the time to build the frame and to fetch the
///   answer. youbot-sim advances its robot until just before it answers, however late that is: its stamp is
///   the arrival of the answer. In lock-step, simulated time and stamps advance by one millisecond per frame.
/// - `enable` clears the drives' time-out flags, lets a winding cool whose I²t limit was exceeded, finds the
///   commutation where needed (with firmware 2.0 the joints move slightly) and homes the arms if requested.
///   `sample.enabled` is true once all drives obey; that may take seconds. The drives hold still until such a
///   sample has been returned: homing moves the zero, so a command made before means another position.
/// - A slave that is lost or leaves OP, or a drive's error flag, switches all drives off (motor stop) and is
///   latched. Lost slaves are configured again as soon as they are back; motion needs a new `enable`.
/// - If an interface takes no frames for longer than can be bridged, the fault names it and the system's
///   error.
/// - With another master on the bus, activate() fails; during operation it is a fault while that master is
///   present.
/// - A gripper that is missing or fails never stops the arm.
/// - A drive that received nothing for 100 ms holds its position at that time on its own, until its time-out
///   flag is cleared: while disabled, under a commanded stop, or by `enable`. Until then the sample shows the
///   flag.
/// - deactivate() stops the motors and leaves OP. A moving gripper is stopped first, for at most 0.3 s.
/// `open_link` is called by activate(); `clock` must outlive the robot.
std::unique_ptr<Robot> make_ethercat_robot(
    std::function<std::unique_ptr<drivers::ethercat::Link>()> open_link, const EthercatOptions& options,
    const Clock& clock, std::chrono::nanoseconds period);

/// Setup: the error of such a parameter, to follow its name in a message; empty if valid.
std::string check(const EthercatOptions::Parameter& parameter);

/// On a network interface, "eth0". @throws std::invalid_argument if `clock` is not the machine's: in virtual
/// time only a drivers::ethercat::LockStepLink leads to slaves outside this program.
std::unique_ptr<Robot> make_ethercat_robot(const std::string& interface, const EthercatOptions& options,
                                           const Clock& clock, std::chrono::nanoseconds period);

}  // namespace hal
