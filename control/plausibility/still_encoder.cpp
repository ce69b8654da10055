#include "control/plausibility/still_encoder.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace control {
namespace {

constexpr int kFewestStillSamples = 10;
/// Over a longer time, slow drifts of the reading would add up to a change.
constexpr double kLongestStill_s = 2.0;
constexpr double kTorqueSmoothing_s = 0.01;
/// The sticking contact under a loaded wheel oscillates at about 100 rad/s: time that it may take to give
/// way, and to return past a turning point.
constexpr double kReaction_s = 0.04;
/// A set-point that has moved this far has made any velocity or position loop apply torque.
constexpr double kWay_rad = 0.02;

}  // namespace

void StillEncoder::Range::add(double value) noexcept {
  low = std::min(low, value);
  high = std::max(high, value);
}

bool StillEncoder::update(const hal::JointCommand& command, const hal::JointSample& sample,
                          const SampleTime& time) noexcept {
  const double elapsed_s = time.elapsed_s;
  const bool moved = sample.position_rad != position_rad_;
  // For a drive that reports only magnitudes, the sign comes from the command, in torque mode only.
  const double torque_Nm =
      command.mode == hal::CommandMode::kTorque ? sample.torque_Nm : std::abs(sample.torque_Nm);
  if (samples_ == 0 || moved || command.mode != mode_ || still_s_ > kLongestStill_s) {
    begin(command, sample, torque_Nm);
    return false;
  }
  ++samples_;
  still_s_ += elapsed_s;
  // A plain mean at first, then a moving one: torque from before the last count is excluded.
  const double blend = elapsed_s / (std::min(still_s_, kTorqueSmoothing_s) + elapsed_s);
  torque_Nm_ += blend * (torque_Nm - torque_Nm_);
  target_value_ += blend * (command.target - target_value_);
  if (still_s_ - time.unsure_s() <= kTorqueSmoothing_s) {
    torque_.begin(torque_Nm_);
    target_.begin(target_value_);
  } else {
    torque_.add(torque_Nm_);
    target_.add(target_value_);
  }
  if (mode_ == hal::CommandMode::kVelocity) asked_rad_ += command.target * elapsed_s;
  // Of the interval in which it began, at most one regular cycle counts.
  const bool was_driven = std::exchange(driven_, driven(mode_));
  driven_s_ = was_driven ? driven_s_ + elapsed_s : std::min(elapsed_s, kRegularSample_s) - time.unsure_s();
  return driven_ && samples_ >= kFewestStillSamples && driven_s_ - time.unsure_s() >= kReaction_s;
}

void StillEncoder::begin(const hal::JointCommand& command, const hal::JointSample& sample,
                         double torque_Nm) noexcept {
  samples_ = 1;
  still_s_ = asked_rad_ = driven_s_ = 0.0;
  driven_ = false;
  position_rad_ = sample.position_rad;
  mode_ = command.mode;
  torque_Nm_ = torque_Nm;
  target_value_ = command.target;
  torque_.begin(torque_Nm_);
  target_.begin(target_value_);
}

bool StillEncoder::driven(hal::CommandMode mode) const noexcept {
  switch (mode) {
    // The reading lags and may have half the size; TorqueAgreement checks that.
    case hal::CommandMode::kTorque:
      return target_.width() >= change_Nm_ && torque_.width() >= 0.4 * change_Nm_;
    case hal::CommandMode::kVelocity:
      return torque_.width() >= 2 * change_Nm_ || std::abs(asked_rad_) >= kWay_rad;
    case hal::CommandMode::kPosition: return torque_.width() >= change_Nm_ || target_.width() >= kWay_rad;
  }
  return false;
}

}  // namespace control
