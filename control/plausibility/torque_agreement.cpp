#include "control/plausibility/torque_agreement.h"

#include <algorithm>
#include <cmath>

namespace control {
namespace {

/// Share of the command: gains of current sensors are off by some percent.
constexpr double kTorqueShare = 0.2;
/// Alarm after 15 ms of an excess of 4 % of the limit.
constexpr double kTorqueAlarm_s = 0.0006;
/// No single sample decides.
constexpr double kFewestTorques = 6;
/// Frozen: this many equal readings while the command changes by more than the bias plus this share of it.
constexpr int kFewestSame = 30;
constexpr double kUnanswered = 0.3;
constexpr double kSpeedSmoothing_s = 0.003;
/// Time for which a change of speed counts and affects the current.
constexpr double kLately_s = 0.05;

}  // namespace

void TorqueAgreement::restart() noexcept {
  count_ = 0;
  position_known_ = false;
}

void TorqueAgreement::command(const hal::JointCommand& command) noexcept {
  if (command.mode != hal::CommandMode::kTorque) {
    restart();
    return;
  }
  commands_Nm_[count_++ % kMemory] = std::clamp(command.target, -limit_Nm_, limit_Nm_);
}

bool TorqueAgreement::update(double position_rad, double torque_Nm, double elapsed_s) noexcept {
  watch_speed(position_rad, elapsed_s);
  if (count_ < kMemory) {
    excess_Nm_s_ = 0.0;
    same_ = 0;
    return false;
  }
  if (frozen(torque_Nm)) return true;
  const auto [low, high] = std::minmax_element(commands_Nm_.begin(), commands_Nm_.end());
  if (*high < 0 && torque_Nm < *high / 2) shows_sign_ = true;
  const bool magnitude_only = *high < 0 && torque_Nm > 0 && !shows_sign_;
  const double torque = magnitude_only ? -torque_Nm : torque_Nm;
  const double off_Nm = std::max({0.0, *low - torque, torque - *high});
  const double slack_Nm = bias_Nm_ + kTorqueShare * std::max(std::abs(*low), std::abs(*high));
  const double alarm_Nm_s = kTorqueAlarm_s * limit_Nm_;
  excess_Nm_s_ =
      std::max(0.0, excess_Nm_s_ + std::min((off_Nm - slack_Nm) * elapsed_s, alarm_Nm_s / kFewestTorques));
  return excess_Nm_s_ > alarm_Nm_s + blow_Nm_s2_per_rad_ * changed_rad_per_s_;
}

void TorqueAgreement::watch_speed(double position_rad, double elapsed_s) noexcept {
  if (!position_known_) {
    position_known_ = true;
    velocity_rad_per_s_ = earlier_rad_per_s_ = changed_rad_per_s_ = 0.0;
    position_rad_ = position_rad;
    return;
  }
  const double rate = (position_rad - position_rad_) / elapsed_s;
  position_rad_ = position_rad;
  velocity_rad_per_s_ += elapsed_s / (kSpeedSmoothing_s + elapsed_s) * (rate - velocity_rad_per_s_);
  earlier_rad_per_s_ += elapsed_s / (kLately_s + elapsed_s) * (velocity_rad_per_s_ - earlier_rad_per_s_);
  changed_rad_per_s_ = std::max(std::abs(velocity_rad_per_s_ - earlier_rad_per_s_),
                                kLately_s / (kLately_s + elapsed_s) * changed_rad_per_s_);
}

bool TorqueAgreement::frozen(double torque_Nm) noexcept {
  const double command_Nm = commands_Nm_[(count_ - 1) % kMemory];
  if (torque_Nm != reading_Nm_ || same_ == 0) {
    reading_Nm_ = torque_Nm;
    low_Nm_ = high_Nm_ = command_Nm;
    same_ = 0;
  }
  ++same_;
  low_Nm_ = std::min(low_Nm_, command_Nm);
  high_Nm_ = std::max(high_Nm_, command_Nm);
  return same_ >= kFewestSame && high_Nm_ - low_Nm_ >= (1 + kUnanswered) * bias_Nm_;
}

}  // namespace control
