/// @file
/// A robot with one joint that turns by itself and ignores its commands.
#pragma once
#include <chrono>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "hal/clock.h"
#include "hal/robot.h"

namespace support {

class TurningRobot final : public hal::Robot {
 public:
  TurningRobot(const hal::Clock& clock, std::vector<hal::JointInfo> joints, std::size_t joint,
               double speed_rad_per_s, std::vector<double> start_rad = {})
      : clock_(clock),
        joints_(std::move(joints)),
        joint_(joint),
        speed_(speed_rad_per_s),
        start_rad_(std::move(start_rad)) {
    start_rad_.resize(joints_.size());
  }
  std::span<const hal::JointInfo> joints() const noexcept override { return joints_; }
  void activate() override {}
  void deactivate() noexcept override {}
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    sample.stamp = sample.earliest = sample.latest = clock_.now();
    sample.enabled = command.enable;
    was_enabled = was_enabled || command.enable;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      sample.joints[i].homed = true;
      sample.joints[i].position_rad = start_rad_[i];
      // Its current follows, its motion does not.
      sample.joints[i].torque_Nm =
          command.joints[i].mode == hal::CommandMode::kTorque ? command.joints[i].target : 0.0;
    }
    sample.joints[joint_].position_rad += speed_ * std::chrono::duration<double>(sample.stamp).count();
    sample.joints[joint_].velocity_rad_per_s = speed_;
    return {};
  }

  bool was_enabled = false;

 private:
  const hal::Clock& clock_;
  std::vector<hal::JointInfo> joints_;
  std::size_t joint_;
  double speed_;
  std::vector<double> start_rad_;
};

}  // namespace support
