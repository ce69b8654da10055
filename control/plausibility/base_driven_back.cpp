#include "control/plausibility/base_driven_back.h"

#include <algorithm>
#include <utility>

namespace control {
namespace {

constexpr double kDrivenBlock_s = 0.02;
/// A base that moves less than 1 cm/s in a block rests.
constexpr double kRestSpeed_rad_per_s = 0.2;
/// Energy of the torque limit over this angle: elastic contacts, and errors of torque and time.
constexpr double kTakenOutInError_rad = 0.35;
/// Share of a wheel's torque limit at the rims, 16 N: what a push may exceed friction by. A base of little
/// friction, 20 N, that is reversed opposes more than that.
constexpr double kPushShare = 0.3;
/// Share of the arm's energy that may reach the base.
constexpr double kArmShare = 0.25;
/// Energy of the torque limit over this angle: 1 J.
constexpr double kSeenToObey_rad = 0.4;

}  // namespace

void BaseDrivenBack::restart() noexcept { *this = BaseDrivenBack(limit_Nm_); }

bool BaseDrivenBack::update(const WheelVector& position_rad, const WheelVector& torque_Nm, double arm_J,
                            double elapsed_s) noexcept {
  if (!known_) {
    known_ = true;
    position_rad_ = position_rad;
    torque_Nm_ = torque_Nm;
    return false;
  }
  const WheelVector moved_rad = position_rad - position_rad_;
  way_rad_ += moved_rad;
  work_J_ += torque_Nm_.cwiseMax(-limit_Nm_).cwiseMin(limit_Nm_).dot(moved_rad);
  duration_s_ += elapsed_s;
  position_rad_ = position_rad;
  torque_Nm_ = torque_Nm;
  from_arm_J_ = std::max(from_arm_J_, kArmShare * arm_J);
  if (duration_s_ < kDrivenBlock_s) return false;
  const bool driven_back = judge();
  way_rad_.setZero();
  work_J_ = duration_s_ = 0.0;
  return driven_back;
}

bool BaseDrivenBack::judge() noexcept {
  const double speed = way_rad_.norm() / 2 / duration_s_;
  const bool slows_down = speed < std::exchange(speed_rad_per_s_, speed);
  if (way_rad_.cwiseAbs().maxCoeff() < kRestSpeed_rad_per_s * duration_s_) {
    begun_ = true;
    put_in_J_ = std::max(put_in_J_, 0.0);
    turned_rad_ = from_arm_J_ = 0.0;
  }
  if (!begun_) return false;
  put_in_J_ += slows_down ? std::max(work_J_, 0.0) : work_J_;
  turned_rad_ += way_rad_.norm() / 2;
  moves_with_torque_ = moves_with_torque_ || put_in_J_ > kSeenToObey_rad * limit_Nm_;
  const double allowed_rad = kTakenOutInError_rad + kPushShare * turned_rad_;
  return !moves_with_torque_ && -put_in_J_ > allowed_rad * limit_Nm_ + from_arm_J_;
}

}  // namespace control
