/// @file
/// Torque on one joint of the arm from the arm's weight.
#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "control/robot_model.h"
#include "hal/robot.h"

namespace youbot_bench {

/// From the model of the arm on a level base with an empty gripper. One thread. Cycle: all but construction.
class ArmWeight {
 public:
  /// `joint`: index in `joints`. Without effect for a joint that is not part of a complete arm.
  ArmWeight(std::span<const hal::JointInfo> joints, std::size_t joint);

  /// Joint of the same arm that is not homed; -1 if there is none.
  int first_not_homed(const hal::RobotSample& sample) const noexcept;
  /// Maximum magnitude between two positions of the joint, with the other joints as they are. N·m; zero if
  /// unknown.
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
