/// @file
/// A robot of which one joint turns by itself and ignores its commands.
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
               double speed_rad_per_s)
      : clock_(clock), joints_(std::move(joints)), joint_(joint), speed_(speed_rad_per_s) {}
  std::span<const hal::JointInfo> joints() const noexcept override { return joints_; }
  void activate() override {}
  void deactivate() noexcept override {}
  hal::CycleStatus exchange(const hal::RobotCommand& command, hal::RobotSample& sample) noexcept override {
    sample.stamp = clock_.now();
    sample.enabled = command.enable;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      sample.joints[i].homed = true;
      // Its current follows, its motion does not.
      sample.joints[i].torque_Nm =
          command.joints[i].mode == hal::CommandMode::kTorque ? command.joints[i].target : 0.0;
    }
    sample.joints[joint_].position_rad = speed_ * std::chrono::duration<double>(sample.stamp).count();
    sample.joints[joint_].velocity_rad_per_s = speed_;
    return {};
  }

 private:
  const hal::Clock& clock_;
  std::vector<hal::JointInfo> joints_;
  std::size_t joint_;
  double speed_;
};

}  // namespace support
