#include "tests/support/robot_watch.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace support {
namespace {

using namespace std::chrono_literals;
using drivers::tmcl::ControllerMode;
using Mode = FollowedDrive::Mode;

/// Half a count of current at the largest gear, and a count of speed.
constexpr double kTorqueCount_Nm = 3e-3;
constexpr double kSpeedCount_rad_per_s = 5e-3;
/// Homing leaves a joint within a degree of its end stop, and the gear gives.
constexpr double kHomed_rad = 0.03;

std::string milliseconds_of(nanoseconds time) { return std::to_string(time / 1ms) + " ms"; }

}  // namespace

bool is_homed(double counter_rad, double true_rad) noexcept {
  return std::abs(counter_rad - true_rad) < kHomed_rad;
}

FollowedDrive followed_by(const sim::bus::TmcmBoard& board, double true_rad) {
  FollowedDrive drive{.unheard = board.unheard()};
  const auto& followed = board.followed();
  if (!followed || board.i2t().exceeded()) return drive;
  const sim::bus::MotorUnits& units = board.units();
  if (board.input().flags.has(drivers::tmcl::StatusFlag::kTimeout)) {
    drive.mode = Mode::kHeld;
    return drive;
  }
  switch (followed->mode) {
    case ControllerMode::kPosition:
      drive.mode = Mode::kPosition;
      drive.target = units.position_rad(followed->value);
      drive.homed = is_homed(units.position_rad(board.input().position_ticks), true_rad);
      break;
    case ControllerMode::kVelocity:
      drive.mode = Mode::kVelocity;
      drive.target = units.velocity_rad_per_s(followed->value);
      break;
    case ControllerMode::kPwm:
      drive.mode = Mode::kPwm;
      drive.target = followed->value;
      break;
    case ControllerMode::kCurrent:
      drive.mode = Mode::kCurrent;
      drive.target = units.torque_Nm(followed->value);
      break;
    default: drive.mode = Mode::kStopped; break;
  }
  return drive;
}

void look_at(sim::bus::YoubotBus& bus, std::span<FollowedDrive> drives) {
  for (std::size_t joint = 0; joint < drives.size(); ++joint)
    drives[joint] = followed_by(bus.board(joint), bus.position_rad(joint));
}

double torque_limit_Nm(const sim::bus::BoardAxis& axis) {
  return axis.current_limit_A * axis.torque_constant_Nm_per_A * axis.gear_ratio;
}

DriveLimits wheel_limits(std::size_t wheel) {
  // The motor's fastest positioning, 4000 rpm (parameter 4).
  const sim::bus::BoardAxis& axis = sim::bus::kWheelBoardAxis;
  return {.name = "wheel-" + std::to_string(wheel + 1),
          .torque_Nm = torque_limit_Nm(axis),
          .speed_rad_per_s = 4000 * 2 * std::numbers::pi / 60 / axis.gear_ratio};
}

DriveLimits arm_limits(std::string name, const sim::bus::ArmJointData& joint) {
  return {.name = std::move(name),
          .torque_Nm = torque_limit_Nm(joint.axis),
          .speed_rad_per_s = std::numbers::pi / 2,  // user manual
          .range = {joint.lower_stop_rad, joint.upper_stop_rad}};
}

std::vector<DriveLimits> robot_limits(bool has_base, std::size_t arms) {
  std::vector<DriveLimits> limits;
  for (std::size_t i = 0; has_base && i < 4; ++i) limits.push_back(wheel_limits(i));
  for (std::size_t arm = 0; arm < arms; ++arm)
    for (std::size_t i = 0; i < 5; ++i)
      limits.push_back(
          arm_limits((arm == 0 ? "arm-" : "arm2-") + std::to_string(i + 1), sim::bus::kArmJointData[i]));
  return limits;
}

RobotWatch::RobotWatch(std::vector<DriveLimits> limits, const Allowance& allowance)
    : limits_(std::move(limits)), allowance_(allowance), joints_(limits_.size()) {}

void RobotWatch::permit() {
  permitted_ = true;
  obeys_ = false;
  std::ranges::fill(joints_, Joint{});
}

void RobotWatch::forbid() {
  if (!permitted_) return;
  forbidden_at_ = now_;
  permitted_ = obeys_ = false;
}

void RobotWatch::look(nanoseconds now, std::span<const FollowedDrive> drives) {
  const nanoseconds passed = now - now_;
  now_ = now;
  for (std::size_t joint = 0; joint < drives.size(); ++joint) {
    const bool hears = drives[joint].unheard <= sim::bus::TmcmBoard::kPeriod;
    joints_[joint].heard += !permitted_ && hears ? passed : 0ms;
    if (drives[joint].acts()) {
      check_permission(limits_[joint].name, drives[joint], joints_[joint].heard);
      check_limits(limits_[joint], drives[joint]);
    }
    check_restart(joint, drives[joint]);
  }
}

void RobotWatch::check_permission(const std::string& name, const FollowedDrive& drive, nanoseconds heard) {
  if (allowance_.watchdog && drive.unheard > kWatchdog)
    violate(name + " is commanded later than " + milliseconds_of(kWatchdog) + " after the last process data");
  if (permitted_) return;
  if (heard > allowance_.until_heard || (allowance_.watchdog && now_ > forbidden_at_ + kWatchdog))
    violate(name + " is commanded without an enable");
}

void RobotWatch::check_restart(std::size_t number, const FollowedDrive& drive) {
  Joint& joint = joints_[number];
  if (!drive.acts()) {
    // The master cannot know a drive's motion between two frames; the watchdog bounds it.
    const bool hears = drive.unheard <= sim::bus::TmcmBoard::kPeriod;
    joint.rested += joint.worked && hears && drive.mode < Mode::kPosition ? 1 : 0;
    return;
  }
  if (permitted_ && joint.rested >= 2)
    violate(limits_[number].name + " is commanded again in a run that stopped it");
  joint.worked = joint.worked || drive.mode == Mode::kCurrent || obeys_;
  joint.rested = 0;
}

void RobotWatch::check_limits(const DriveLimits& limits, const FollowedDrive& drive) {
  const auto beyond = [&](const char* unit) {
    violate(limits.name + " is commanded " + std::to_string(drive.target) + " " + unit);
  };
  // Negated so that NaN fails the checks.
  const double size = std::abs(drive.target);
  switch (drive.mode) {
    case Mode::kCurrent:
      if (!(size <= limits.torque_Nm + kTorqueCount_Nm)) beyond("N.m");
      break;
    case Mode::kVelocity:
      if (!(size <= limits.speed_rad_per_s + kSpeedCount_rad_per_s) || std::isinf(size)) beyond("rad/s");
      break;
    case Mode::kPosition:
      if (!std::isfinite(size) || (drive.homed && (drive.target < limits.range.lower_rad - kHomed_rad ||
                                                   drive.target > limits.range.upper_rad + kHomed_rad)))
        beyond("rad, out of its range");
      break;
    default: break;
  }
}

void RobotWatch::violate(const std::string& what) {
  constexpr std::size_t kMax = 20;
  const auto same = [&what](const std::string& known) { return known.ends_with(": " + what); };
  if (violations_.size() < kMax && std::ranges::none_of(violations_, same))
    violations_.push_back("at " + milliseconds_of(now_) + ": " + what);
}

}  // namespace support
