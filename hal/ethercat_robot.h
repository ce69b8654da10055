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
/// As long as the boards' own watchdog.
inline constexpr std::chrono::milliseconds kSimulatorPatience{100};

struct EthercatOptions {
  YoubotKind kind = YoubotKind::kBaseAndArm;
  /// Poll the network interface instead of sleeping on it: faster, and takes the core.
  bool busy_wait = false;
  /// The motor controllers report the current's magnitude only (a property of the firmware).
  bool unsigned_current = false;
  /// Cycles without an answer, or with slaves missing, that are bridged with the last sample. By default
  /// kToleratedCycles; without an answer as many as make up kSimulatorPatience on a bus on which every slave
  /// says in its EEPROM that youbot-sim emulates it, and nowhere else.
  std::optional<int> tolerated_cycles{};
  /// Shares of the last 1000 cycles that were bridged so. From the first on, a warning: trouble() and
  /// losses() say it; from the second on, a fault. One bridge alone has to stay below it.
  double loss_warning = 0.02;
  double loss_fault = 0.2;
  /// A cycle waits so long for its answer. On a robot less than a period; for slaves that a busy machine
  /// emulates and that have all the time, more.
  std::chrono::nanoseconds frame_timeout = std::chrono::microseconds(500);
  /// Let the slaves' clocks follow one reference. The youBot's boards are said not to bear it.
  bool distributed_clocks = false;
  /// Arm joints that do not know their zero find it at their end stops when the robot is enabled: the arm
  /// MOVES, all joints at once. Fold it by hand first.
  bool home_arms = false;
  /// Written to the drives at start-up, and again to one that lost its power. Not kept in EEPROM.
  struct Parameter {
    std::string joint{};  ///< "wheel-1"
    std::string name{};   ///< as youbot-bench parameters lists it
    std::int32_t value = 0;
  };
  std::vector<Parameter> parameters{};
  /// Sees every frame, such as a ring to be written after a fault; outlives the robot. Null: none.
  drivers::ethercat::FrameTap* tap = nullptr;
};

/// Joints in bus order: wheel-1 … wheel-4, arm-1 … arm-5, arm2-1 … arm2-5 (those the kind has).
///
/// - activate() scans, compares with the expected topology, reads the firmware versions, takes all slaves to
///   OP. A base with one or two arms is also a base, and one with two arms a base with one: the drives of the
///   arm too many, and its gripper, are left off in PRE-OP, and notes() says so.
/// - A sample's stamp is taken as soon as its frame has been sent: then it passes the boards, and they put in
///   what they measured last. How long the frame took to make, or its answer to fetch, is not in it.
///   youbot-sim lets its robot go on until just before it answers, however late that is: there the stamp is
///   when the answer was there. A simulation in lock-step goes by its frames, a millisecond each, and so do
///   the stamps.
/// - `enable` clears the drives' time-out flags, lets a winding cool whose I²t limit was exceeded, finds the
///   commutation where needed (with firmware 2.0 the joints move a little) and homes the arms if that is
///   wanted. `sample.enabled` is true once all drives obey; that may take seconds. They hold still until such
///   a sample has come: homing moves the zero, so that a command made before means another place.
/// - A slave that is lost or falls out of OP, or a drive's error flag, switches all drives off (motor stop)
///   and is latched. Lost slaves are configured again as soon as they are back; motion needs a new `enable`.
/// - An interface that takes no frames for longer than is bridged is named with the system's error.
/// - Another master on the bus refuses activate(), and is a fault as long as it is there.
/// - A gripper that is missing or fails never stops the arm.
/// - A drive that heard nothing for 100 ms holds the place it had then, by itself, until its time-out flag is
///   cleared: while disabled, under a commanded stop, or by `enable`. Until then the sample shows the flag.
/// - deactivate() stops the motors and leaves OP. A gripper that moves is stopped first, for 0.3 s at most.
/// `open_link` is called by activate(); `clock` outlives the robot.
std::unique_ptr<Robot> make_ethercat_robot(
    std::function<std::unique_ptr<drivers::ethercat::Link>()> open_link, const EthercatOptions& options,
    const Clock& clock, std::chrono::nanoseconds period);

/// Setup: what is wrong with such a parameter, to follow its name in a message; empty when nothing is.
std::string check(const EthercatOptions::Parameter& parameter);

/// On a network interface, "eth0". @throws std::invalid_argument when `clock` is not the machine's: in
/// virtual time only a drivers::ethercat::LockStepLink leads to slaves outside this program.
std::unique_ptr<Robot> make_ethercat_robot(const std::string& interface, const EthercatOptions& options,
                                           const Clock& clock, std::chrono::nanoseconds period);

}  // namespace hal
