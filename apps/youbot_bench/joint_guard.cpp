#include "apps/youbot_bench/joint_guard.h"

#include <algorithm>
#include <cmath>

#include "identification/experiments/rehearsal.h"

namespace youbot_bench {
namespace {

/// Closer to the end than any plan goes.
constexpr double kStopMargin_rad = 0.03;
/// Below this speed, it is the noise of a joint at rest.
constexpr double kResting_rad_per_s = 0.02;
/// Removes current noise; a velocity loop at an obstacle takes about 10 ms more to reach the same torque.
constexpr double kTorqueCutoff_rad_per_s = 100.0;
/// Share of its torque limit, above friction. A joint that carries weight is only moved by velocity commands,
/// and moves within the time-out.
constexpr double kHardShare = 0.5;
constexpr double kHardPatience_s = 0.25;
/// A drive that counts whole revolutions per minute may round slower commands to zero, or take time to
/// overcome stiction.
constexpr double kCertainlyTurning_rad_per_s = 0.05;
constexpr double kPatience_s = 3.0;
/// Minimum share of the commanded velocity at which a joint follows.
constexpr double kFollows = 0.1;

}  // namespace

JointGuard::JointGuard(const hal::JointInfo& joint, double period_s) noexcept
    : range_(joint.range),
      rated_torque_Nm_(joint.rated_torque_Nm),
      blocked_torque_Nm_(kHardShare * std::min(joint.torque_limit_Nm, joint.rated_torque_Nm)),
      period_s_(period_s),
      torque_(kTorqueCutoff_rad_per_s, period_s) {}

JointGuard::Trip JointGuard::watch(const identification::experiments::Reading& reading,
                                   const hal::JointCommand& command) noexcept {
  torque_.step(reading.torque_Nm);
  if (near_stop(reading)) return Trip::kNearStop;
  if (std::abs(torque_.value()) > rated_torque_Nm_) return Trip::kTorque;
  return blocked(reading, command) ? Trip::kBlocked : Trip::kNone;
}

bool JointGuard::near_stop(const identification::experiments::Reading& reading) const noexcept {
  const double speed = reading.velocity_rad_per_s;
  const double coasting_rad =
      identification::experiments::stopping_distance_rad(std::abs(speed)) + kStopMargin_rad;
  if (speed > kResting_rad_per_s) return reading.position_rad + coasting_rad > range_.upper_rad;
  if (speed < -kResting_rad_per_s) return reading.position_rad - coasting_rad < range_.lower_rad;
  return false;
}

bool JointGuard::blocked(const identification::experiments::Reading& reading,
                         const hal::JointCommand& command) noexcept {
  const bool by_velocity = command.mode == hal::CommandMode::kVelocity;
  const double wanted = std::abs(command.target);
  const double turning_rad_per_s = by_velocity ? kFollows * wanted : kResting_rad_per_s;
  const bool turns = std::abs(reading.velocity_rad_per_s) >= turning_rad_per_s;
  const bool hard = std::abs(torque_.value()) > blocked_torque_Nm_;
  pushed_hard_s_ = hard && !turns ? pushed_hard_s_ + period_s_ : 0.0;
  const bool certain = by_velocity && wanted >= kCertainlyTurning_rad_per_s;
  asked_to_turn_s_ = certain && !turns ? asked_to_turn_s_ + period_s_ : 0.0;
  return pushed_hard_s_ > kHardPatience_s || asked_to_turn_s_ > kPatience_s;
}

}  // namespace youbot_bench
