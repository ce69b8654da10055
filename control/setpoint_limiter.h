/// @file
/// Limits speed, acceleration and jerk of a set-point.
#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "control/positive.h"

namespace control {

/// Speed, acceleration and jerk: m/s, m/s², m/s³, or rad/s and so on.
///
/// libfranka documents, for a Franka Research 3 (franka/rate_limiting.h, 2023; joint speeds in its "Limits"):
///   a joint                     2.62 rad/s   10 rad/s²   5000 rad/s³
///   end effector, translation   3.0 m/s       9 m/s²     4500 m/s³
///   end effector, rotation      2.5 rad/s    17 rad/s²   8500 rad/s³
/// A youBot's gears make its axes slower. Acceleration and jerk are scaled down by the ratio of the speeds,
/// so that top speed and top acceleration are reached in the same times; further where the drive has its own
/// ramp.
struct SetpointLimits {
  double speed;
  double acceleration;
  double jerk;
};
/// A joint in position mode. 90°/s, 0.6 of libfranka's, would allow 6 rad/s², but the boards ramp their
/// motors by 2000 rpm per second (parameter 11 of the factory dump): a = 1.34 rad/s² behind joint 1's gear
/// ratio of 156. To be able to stop, a board's position lags by v²/2a behind a set-point of speed v: 0.24 rad
/// at 0.8 rad/s.
inline constexpr SetpointLimits kArmJointLimits{0.8, 1.34, 670.0};
/// 0.6 of the joint speed (90°/s, hal/youbot_axes.h) on an arm of 0.655 m instead of 0.855 m: 0.46 of
/// libfranka's end effector; rotation 0.6.
inline constexpr SetpointLimits kTipLimits{1.38, 4.1, 2070.0};
inline constexpr SetpointLimits kTipTurnLimits{1.5, 10.2, 5100.0};
/// Wheels of 47.5 mm radius at 16.2 rad/s: 0.77 m/s (KUKA specifies 0.8), or 2 rad/s about the centre.
inline constexpr SetpointLimits kBaseLimits{0.8, 2.4, 1200.0};
inline constexpr SetpointLimits kBaseTurnLimits{2.0, 13.6, 6800.0};

/// Limits a set-point along kAxes axes together, in the Euclidean norm. A target within the limits passes
/// unchanged. Otherwise the set-point follows as soon as the limits allow, and reaches the target without
/// overshoot.
/// Cycle: all but construction.
template <int kAxes>
class SetpointLimiter {
 public:
  using Vector = Eigen::Matrix<double, kAxes, 1>;
  using Box = Eigen::AlignedBox<double, kAxes>;

  /// @throws std::invalid_argument for a limit that is not finite and positive.
  explicit SetpointLimiter(const SetpointLimits& limits) : limits_(limits) {
    const RequirePositive require_positive{"set-point limits"};
    require_positive(limits.speed, "speed");
    require_positive(limits.acceleration, "acceleration");
    require_positive(limits.jerk, "jerk");
  }

  /// At rest at this position.
  void reset(const Vector& position = Vector::Zero()) noexcept {
    position_ = target_ = position;
    velocity_.setZero();
    acceleration_.setZero();
    limited_ = false;
  }

  /// Set-point in place of `target`; `elapsed_s` since the last step, positive. Accelerations are computed
  /// over at least `period_s`: a late wake-up followed by an early one is not a jerk.
  const Vector& step(const Vector& target, double elapsed_s, double period_s) noexcept {
    const Vector behind = target_ - position_;
    const Vector target_velocity = (target - target_) / elapsed_s;
    target_ = target;
    accelerate(slowed((target - position_) / elapsed_s, behind, target_velocity, period_s),
               std::max(elapsed_s, period_s));
    limited_ = limited_ || is_behind(behind);
    position_ = limited_ ? Vector(position_ + velocity_ * elapsed_s) : target;
    return position_;
  }

  // The parts of step(), for set-points that are not vectors.

  /// For a set-point that is `behind` its target: limits the speed towards it so that it can stop there.
  Vector slowed(const Vector& wanted, const Vector& behind, const Vector& target_velocity,
                double period_s) const noexcept {
    if (!is_behind(behind)) return wanted;
    const double way = behind.norm();
    const Vector towards = behind / way;
    const double too_fast = (wanted - target_velocity).dot(towards) - braking_speed(way, period_s);
    return wanted - std::max(0.0, too_fast) * towards;
  }
  /// Limits the speed towards a workspace limit so that it can stop there.
  Vector slowed_before(const Box& walls, const Vector& position, const Vector& wanted,
                       double period_s) const noexcept {
    Vector slower = wanted;
    for (Eigen::Index i = 0; i < kAxes; ++i)
      slower[i] = std::clamp(wanted[i], -braking_speed(position[i] - walls.min()[i], period_s),
                             braking_speed(walls.max()[i] - position[i], period_s));
    return slower;
  }
  /// Changes velocity() towards `wanted` for `elapsed_s`.
  void accelerate(const Vector& wanted, double elapsed_s) noexcept {
    const Vector allowed = cut(wanted, limits_.speed);
    const Vector exact = (allowed - velocity_) / elapsed_s;
    const Vector change = cut(exact - acceleration_, limits_.jerk * elapsed_s);
    const Vector acceleration = cut(acceleration_ + change, limits_.acceleration);
    limited_ = !(acceleration - exact).isZero(kSlack * limits_.acceleration) ||
               !(allowed - wanted).isZero(kSlack * limits_.speed);
    acceleration_ = limited_ ? eased(acceleration, elapsed_s) : exact;
    velocity_ = limited_ ? cut(velocity_ + elapsed_s * acceleration_, limits_.speed) : wanted;
  }
  /// Stops an axis at its workspace limit.
  void stop(Eigen::Index axis) noexcept { velocity_[axis] = acceleration_[axis] = 0.0; }

  const Vector& velocity() const noexcept { return velocity_; }
  const Vector& acceleration() const noexcept { return acceleration_; }
  bool limited() const noexcept { return limited_; }  ///< in the last step

 private:
  static constexpr double kArrived = 1e-7;  // m or rad
  static constexpr double kSlack = 1e-6;    // for rounding

  static bool is_behind(const Vector& behind) noexcept { return behind.norm() > kArrived; }
  static Vector cut(const Vector& value, double most) noexcept {
    const double length = value.norm();
    return length > most ? Vector(value * (most / length)) : value;
  }
  /// Reduces the acceleration shortly before top speed, so that it can end there within the jerk limit.
  Vector eased(const Vector& acceleration, double elapsed_s) const noexcept {
    const double speed = velocity_.norm();
    if (!(speed > 0)) return acceleration;
    const Vector along = velocity_ / speed;
    const double change = limits_.jerk * elapsed_s;
    const double most =
        std::sqrt(change * change / 4 + 2 * limits_.jerk * std::max(0.0, limits_.speed - speed)) - change / 2;
    return acceleration - std::max(0.0, acceleration.dot(along) - most) * along;
  }
  /// Speed from which it comes to rest within `way`: v = √((b·t)² + 2·b·way) − b·t. b is a share of the
  /// acceleration limit, which leaves a margin for corrections; t is the time until braking takes effect.
  double braking_speed(double way, double period_s) const noexcept {
    constexpr double kShare = 0.7;
    const double b = kShare * limits_.acceleration;
    const double lost = b * (2 * limits_.acceleration / limits_.jerk + period_s);
    return std::sqrt(lost * lost + 2 * b * std::max(0.0, way)) - lost;
  }

  SetpointLimits limits_;
  Vector position_ = Vector::Zero();
  Vector target_ = Vector::Zero();
  Vector velocity_ = Vector::Zero();
  Vector acceleration_ = Vector::Zero();
  bool limited_ = false;
};

}  // namespace control
