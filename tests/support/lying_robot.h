/// @file
/// A robot of which one sensor lies from some moment on.
#pragma once
#include <cstddef>
#include <optional>

#include "hal/robot.h"

namespace support {

enum class Channel { kEncoder, kPosition, kVelocity, kTorque, kBoard };
/// What it shows is `factor` times the truth: a position counts on from where it was when the lie began, and
/// what is frozen (`factor` 0) stays as it was, but for the velocity of an encoder that stands still.
struct Lie {
  std::size_t joint = 0;
  Channel channel = Channel::kEncoder;  ///< an encoder is position and velocity, a board is all three
  double factor = 0.0;
};

class LyingRobot final : public hal::Robot {
 public:
  explicit LyingRobot(hal::Robot& robot) : robot_(robot) {}
  std::span<const hal::JointInfo> joints() const noexcept override { return robot_.joints(); }
  void activate() override { robot_.activate(); }
  void deactivate() noexcept override { robot_.deactivate(); }
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    hal::RobotSample truth = truth_;
    const hal::CycleStatus status = robot_.exchange(command, truth);
    truth_ = sample = truth;
    if (lie_) sample.joints[lie_->joint] = seen(truth.joints[lie_->joint]);
    return status;
  }
  /// From the next exchange on.
  void lie(const Lie& lie) noexcept {
    lie_ = lie;
    begin_ = truth_.joints[lie.joint];
  }

 private:
  hal::JointSample seen(hal::JointSample joint) const noexcept {
    const bool board = lie_->channel == Channel::kBoard;
    const bool encoder = lie_->channel == Channel::kEncoder;
    const double factor = lie_->factor;
    const auto scaled = [factor](double value, double frozen) {
      return factor == 0 ? frozen : factor * value;
    };
    if (board || encoder || lie_->channel == Channel::kPosition)
      joint.position_rad = begin_.position_rad + factor * (joint.position_rad - begin_.position_rad);
    if (board || encoder || lie_->channel == Channel::kVelocity)
      joint.velocity_rad_per_s = scaled(joint.velocity_rad_per_s, encoder ? 0.0 : begin_.velocity_rad_per_s);
    if (board || lie_->channel == Channel::kTorque)
      joint.torque_Nm = scaled(joint.torque_Nm, begin_.torque_Nm);
    return joint;
  }

  hal::Robot& robot_;
  std::optional<Lie> lie_;
  hal::RobotSample truth_;
  hal::JointSample begin_;
};

}  // namespace support
