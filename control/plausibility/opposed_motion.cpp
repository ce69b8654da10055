#include "control/plausibility/opposed_motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace control {
namespace {

constexpr double kVelocitySmoothing_s = 0.005;
constexpr double kEarlier_s = 0.02;
/// Delay with which drive and smoothed speed follow a torque.
constexpr double kLag_s = 0.006;
/// Time constant with which older evidence fades: energy taken out in error, and energy from other motors.
constexpr double kFading_s = 0.2;
/// Model error: share of the weight's torque, and share of the torque limit for everything not modelled.
constexpr double kWeightShare = 0.2;
constexpr double kModelShare = 0.03;
/// At lower speeds a base that drives on may push the arm back from a wall.
constexpr double kFast_rad_per_s = 0.7;
/// Energy of the torque limit against 0.01 rad of motion.
constexpr double kTakenOut_rad = 0.01;
/// Share of the other motors' energy that may reach a joint: friction in wheels and gears dissipates most of
/// it. Twice the maximum in hours of simulated contact.
constexpr double kReachingShare = 0.25;
/// Upper bound of that energy: the torque limit over this angle, which a reversed encoder soon exceeds.
constexpr double kReaching_rad = 0.05;
/// Energy of the torque limit over 0.02 rad: no wall springs back so far.
constexpr double kSeen_rad = 0.02;

}  // namespace

void OpposedMotion::Range::add(double torque_Nm) noexcept {
  least_Nm = std::min(least_Nm, torque_Nm);
  most_Nm = std::max(most_Nm, torque_Nm);
}

void OpposedMotion::restart() noexcept {
  known_ = false;
  taken_out_J_ = put_in_J_ = 0.0;
  hall_sense_ = seen_sense_ = 0;
}

void OpposedMotion::update(double position_rad, double torque_Nm, double weight_Nm, int hall_sense,
                           const SampleTime& time) noexcept {
  trust(hall_sense);
  asked_.add(torque_Nm);
  passed_s_ += time.elapsed_s;
  if (time.unsure_s() > 0) return;
  const double elapsed_s = std::exchange(passed_s_, 0.0);
  if (elapsed_s > kComparable_s) known_ = false;  // weight and torque changed too much in between
  if (!known_) {
    known_ = true;
    velocity_rad_per_s_ = earlier_rad_per_s_ = taken_out_J_ = put_in_J_ = known_s_ = 0.0;
    position_rad_ = position_rad;
    asked_ = asked_before_ = {torque_Nm, torque_Nm};
    return;
  }
  const double rate = (position_rad - position_rad_) / elapsed_s;
  position_rad_ = position_rad;
  // Plain means at first: filters that start at zero would both rise, and a braking joint would seem to speed
  // up.
  const auto blend = [&](double smoothing_s) {
    return elapsed_s / (std::min(known_s_, smoothing_s) + elapsed_s);
  };
  velocity_rad_per_s_ += blend(kVelocitySmoothing_s) * (rate - velocity_rad_per_s_);
  earlier_rad_per_s_ += blend(kEarlier_s) * (velocity_rad_per_s_ - earlier_rad_per_s_);
  known_s_ += elapsed_s;

  const double kept = kFading_s / (kFading_s + elapsed_s);
  const double least_Nm = std::min(asked_.least_Nm, asked_before_.least_Nm);
  const double most_Nm = std::max(asked_.most_Nm, asked_before_.most_Nm);
  const double low_Nm = std::clamp(least_Nm, -limit_Nm_, limit_Nm_) - weight_Nm;
  const double high_Nm = std::clamp(most_Nm, -limit_Nm_, limit_Nm_) - weight_Nm;
  asked_s_ += elapsed_s;
  if (asked_s_ > kLag_s) {
    asked_s_ = 0.0;
    asked_before_ = std::exchange(asked_, {torque_Nm, torque_Nm});
  }
  const double power_W = std::max(low_Nm * velocity_rad_per_s_, high_Nm * velocity_rad_per_s_);
  put_in_J_ = kept * put_in_J_ + power_W * elapsed_s;

  const double speed_rad_per_s = std::abs(velocity_rad_per_s_);
  const double error_W = (kWeightShare * std::abs(weight_Nm) + kModelShare * limit_Nm_) * speed_rad_per_s;
  taken_out_J_ *= kept;
  if (speed_rad_per_s < std::abs(earlier_rad_per_s_)) return;  // slows down, as expected against its torque
  seen_J_ += std::copysign(std::max(0.0, std::abs(power_W) - error_W), power_W) * elapsed_s;
  if (vouched_for())
    taken_out_J_ = 0.0;
  else if (speed_rad_per_s > kFast_rad_per_s)
    taken_out_J_ = std::max(0.0, taken_out_J_ + (-power_W - error_W) * elapsed_s);
}

void OpposedMotion::trust(int hall_sense) noexcept {
  hall_sense_ = hall_sense;
  if (hall_sense == 0 || hall_sense == seen_sense_) return;
  seen_sense_ = hall_sense;
  seen_J_ = 0.0;
}

bool OpposedMotion::vouched_for() const noexcept {
  return hall_sense_ != 0 && seen_J_ > kSeen_rad * limit_Nm_;
}

double OpposedMotion::put_in_J() const noexcept { return std::max(0.0, put_in_J_); }

bool OpposedMotion::opposed(double put_in_by_others_J) const noexcept {
  const double reaching_J = std::min(kReachingShare * put_in_by_others_J, kReaching_rad * limit_Nm_);
  return taken_out_J_ > kTakenOut_rad * limit_Nm_ + reaching_J;
}

}  // namespace control
