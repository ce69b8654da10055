/// @file
/// Judges a robot by the commands that its motors follow, independent of the software that commands it.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "hal/joint.h"
#include "sim/bus/axis_data.h"
#include "sim/bus/tmcm_board.h"
#include "sim/bus/youbot_bus.h"

namespace support {

using std::chrono::nanoseconds;

/// Command that the motor of a joint follows.
struct FollowedDrive {
  /// From kPosition on it is commanded. kOpen: without power, or shorted; kHeld: the drive's own watchdog
  /// expired.
  enum class Mode : std::uint8_t { kOpen, kHeld, kStopped, kPosition, kVelocity, kPwm, kCurrent };
  Mode mode = Mode::kOpen;
  double target = 0.0;    ///< rad, rad/s or N·m at the joint, as `mode` says
  nanoseconds unheard{};  ///< time since the drive was last commanded
  bool homed = false;     ///< for kPosition: it has the zero of the joint's range

  bool acts() const noexcept { return mode == Mode::kPosition || (mode > Mode::kPosition && target != 0); }
};

/// For a board. `true_rad`: position of its joint.
FollowedDrive followed_by(const sim::bus::TmcmBoard& board, double true_rad);
/// For each joint of a robot. `drives` has the same size.
void look_at(sim::bus::YoubotBus& bus, std::span<FollowedDrive> drives);
/// Whether a joint's counter has the zero of its range.
bool is_homed(double counter_rad, double true_rad) noexcept;

/// Limits that a joint must never be commanded beyond.
struct DriveLimits {
  std::string name;
  double torque_Nm = 0.0;
  double speed_rad_per_s = 0.0;
  hal::JointRange range{};
};

/// From the data sheets of the simulation, which the HAL does not share.
double torque_limit_Nm(const sim::bus::BoardAxis& axis);
DriveLimits wheel_limits(std::size_t wheel);
DriveLimits arm_limits(std::string name, const sim::bus::ArmJointData& joint);
std::vector<DriveLimits> robot_limits(bool has_base, std::size_t arms);

/// The rules, each checked at the end of each period. They are independent of the test:
/// - Nothing is commanded except between an enable and the following disable or fault: a drive that receives
///   its bus obeys within Allowance::until_heard, any other within its own watchdog.
/// - A drive that worked and was then switched off, or held or released itself while it received its bus, is
///   not commanded again before the next enable.
/// - Nothing is commanded for longer than the watchdog after the last process data.
/// - Targets are finite; torque and speed within the limits; positions of a homed joint within its range.
class RobotWatch {
 public:
  /// The boards' watchdog, parameter 90, plus some periods of boards and bus.
  static constexpr std::chrono::milliseconds kWatchdog{105};

  struct Allowance {
    /// Time that a drive may still be commanded on a working bus after the end of the permission.
    nanoseconds until_heard = std::chrono::milliseconds(2);
    bool watchdog = true;  ///< the drives have one
  };
  explicit RobotWatch(std::vector<DriveLimits> limits) : RobotWatch(std::move(limits), Allowance{}) {}
  RobotWatch(std::vector<DriveLimits> limits, const Allowance& allowance);

  /// The robot may move from now on, until forbid().
  void permit();
  void forbid();
  bool permitted() const noexcept { return permitted_; }
  /// The robot reports that it obeys: until forbid() velocities and positions count as work, as currents
  /// always do. Before, they may be part of a start-up, which stops in between.
  void obeys() noexcept { obeys_ = permitted_; }
  bool obeying() const noexcept { return obeys_; }
  /// A period has passed; `drives` in the order of the limits.
  void look(nanoseconds now, std::span<const FollowedDrive> drives);

  /// Stores each once, with its first time.
  void violate(const std::string& what);
  const std::vector<std::string>& violations() const noexcept { return violations_; }

 private:
  struct Joint {
    bool worked = false;  // since the last enable
    int rested = 0;       // periods since then
    nanoseconds heard{};  // time since the robot was forbidden to move
  };
  void check_permission(const std::string& name, const FollowedDrive& drive, nanoseconds heard);
  void check_restart(std::size_t joint, const FollowedDrive& drive);
  void check_limits(const DriveLimits& limits, const FollowedDrive& drive);

  std::vector<DriveLimits> limits_;
  Allowance allowance_;
  std::vector<Joint> joints_;
  nanoseconds now_{};
  bool permitted_ = false;
  bool obeys_ = false;
  nanoseconds forbidden_at_{};
  std::vector<std::string> violations_;
};

}  // namespace support
