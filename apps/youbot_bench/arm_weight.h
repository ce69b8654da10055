/// @file
/// What the arm's weight asks of one of its joints.
#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "control/robot_model.h"
#include "hal/robot.h"

namespace youbot_bench {

/// By the model of the arm on a level base with an empty gripper. One thread. Cycle: all but construction.
class ArmWeight {
 public:
  /// `joint`: in `joints`. Knows nothing of a joint that is not one of a whole arm.
  ArmWeight(std::span<const hal::JointInfo> joints, std::size_t joint);

  /// Joint of the same arm whose place between its stops is not known; -1 when there is none.
  int first_not_homed(const hal::RobotSample& sample) const noexcept;
  /// Largest magnitude on the way between two positions of the joint, the other joints as they are. N·m; zero
  /// where nothing is known.
  double heaviest_Nm(const hal::RobotSample& sample, double from_rad, double to_rad) noexcept;

 private:
  struct Arm {
    control::RobotModel model;
    std::array<std::size_t, control::kArmJoints> indices;  // in the robot
    Eigen::Index joint;                                    // of the arm, from 0
  };
  std::optional<Arm> arm_;
};

}  // namespace youbot_bench
