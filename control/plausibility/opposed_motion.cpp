#include "control/plausibility/opposed_motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace control {
namespace {

constexpr double kVelocitySmoothing_s = 0.005;
constexpr double kEarlier_s = 0.02;
/// Older evidence fades: what is taken out in error meanwhile.
constexpr double kFading_s = 0.2;
/// Of the weight, and of the limit for what else is not in the model.
constexpr double kWeightShare = 0.2;
constexpr double kModelShare = 0.03;
/// Slower, a base that drives on pushes the arm back from a wall.
constexpr double kFast_rad_per_s = 0.7;
/// At the torque limit, against 0.01 rad of motion.
constexpr double kTakenOut_rad = 0.01;

}  // namespace

bool OpposedMotion::update(double position_rad, double torque_Nm, double weight_Nm,
                           const SampleTime& time) noexcept {
  // After a hold-up the torque before was there until the bus had this one.
  const bool in_time = time.elapsed_s <= kRegularSample_s && !(time.unsure_s > 0);
  if (passed_s_ == 0.0 && in_time) least_Nm_ = most_Nm_ = torque_Nm;
  least_Nm_ = std::min(least_Nm_, torque_Nm);
  most_Nm_ = std::max(most_Nm_, torque_Nm);
  passed_s_ += time.elapsed_s;
  if (time.unsure_s > 0) return false;
  const double elapsed_s = std::exchange(passed_s_, 0.0);
  if (elapsed_s > kComparable_s) known_ = false;  // too much weight and torque lies between
  const double least_Nm = std::exchange(least_Nm_, torque_Nm);
  const double most_Nm = std::exchange(most_Nm_, torque_Nm);
  if (!known_) {
    known_ = true;
    velocity_rad_per_s_ = earlier_rad_per_s_ = taken_out_J_ = 0.0;
    position_rad_ = position_rad;
    return false;
  }
  const double rate = (position_rad - position_rad_) / elapsed_s;
  position_rad_ = position_rad;
  velocity_rad_per_s_ += elapsed_s / (kVelocitySmoothing_s + elapsed_s) * (rate - velocity_rad_per_s_);
  earlier_rad_per_s_ += elapsed_s / (kEarlier_s + elapsed_s) * (velocity_rad_per_s_ - earlier_rad_per_s_);

  taken_out_J_ *= kFading_s / (kFading_s + elapsed_s);
  const double asked_Nm = velocity_rad_per_s_ > 0 ? most_Nm : least_Nm;
  const double net_Nm = std::clamp(asked_Nm, -limit_Nm_, limit_Nm_) - weight_Nm;
  const double opposing_Nm = velocity_rad_per_s_ > 0 ? -net_Nm : net_Nm;
  const double excess_Nm = opposing_Nm - kWeightShare * std::abs(weight_Nm) - kModelShare * limit_Nm_;
  const bool slower = std::abs(velocity_rad_per_s_) < std::abs(earlier_rad_per_s_);
  if (!slower && std::abs(velocity_rad_per_s_) > kFast_rad_per_s)
    taken_out_J_ = std::max(0.0, taken_out_J_ + excess_Nm * std::abs(velocity_rad_per_s_) * elapsed_s);
  return taken_out_J_ > kTakenOut_rad * limit_Nm_;
}

}  // namespace control
