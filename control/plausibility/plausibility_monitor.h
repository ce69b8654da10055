/// @file
/// Checks the plausibility of a robot's sensors: each joint by itself, the four wheels together.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "control/plausibility/away_from_target.h"
#include "control/plausibility/base_driven_back.h"
#include "control/plausibility/checks.h"
#include "control/plausibility/hall_agreement.h"
#include "control/plausibility/opposed_motion.h"
#include "control/plausibility/sample_time.h"
#include "control/plausibility/sense_vote.h"
#include "control/plausibility/still_encoder.h"
#include "control/plausibility/torque_agreement.h"
#include "control/plausibility/velocity_agreement.h"
#include "control/plausibility/velocity_step.h"
#include "control/plausibility/wheel_agreement.h"
#include "control/robot_model.h"
#include "hal/robot.h"

namespace control {

/// Every limit of speed, distance and force relies on a sensor; a wrong sensor disables the limit. Each check
/// compares two quantities from different sources. docs/safety.md lists the detection times, and the faults
/// that no check detects.
/// One thread. Cycle: all but construction.
class PlausibilityMonitor {
 public:
  struct Finding {
    hal::JointFault fault = hal::JointFault::kNone;
    int joint = -1;  ///< -1: of the wheels, one or several, unknown which
  };

  /// Whether the wheels carry the robot, so that they turn together, or each turns freely in the air.
  enum class Wheels { kRolling, kFree };

  /// Joints named "wheel-…" are wheels; if the robot's first four joints are wheels, they form a mecanum
  /// base. The weight of an arm after them is that of the description with the changes `arm`: the model that
  /// the drives' torques carry. @throws std::invalid_argument as RobotModel does.
  PlausibilityMonitor(std::span<const hal::JointInfo> joints, Wheels wheels, const ChecksOff& off = {},
                      const ModelChanges& arm = {});

  void restart() noexcept;
  /// Call once per cycle while the drives obey. `elapsed_s`: from the last sample's stamp to this one's; 0:
  /// no new sample arrived.
  std::optional<Finding> update(const hal::RobotCommand& command, const hal::RobotSample& sample,
                                double elapsed_s) noexcept;

  /// The checks that have judged nothing for the last second, because too few samples arrived in time, or a
  /// joint's Hall sensors were not read. Does not include S3 on a robot whose samples are never close enough
  /// together: there hal::Robot::notes() reports it.
  ChecksOff silent() const noexcept;

 private:
  struct Joint {
    StillEncoder still;
    VelocityAgreement velocity;
    TorqueAgreement torque;
    VelocityStep step;
    HallAgreement hall{};
    AwayFromTarget away{};
  };
  hal::JointFault check(Joint& joint, const hal::JointCommand& command, const hal::JointSample& sample,
                        const SampleTime& time) const noexcept;

  std::optional<Finding> check_arm(const hal::RobotCommand& command, const hal::RobotSample& sample,
                                   const SampleTime& time) noexcept;

  std::optional<Finding> check_senses(double elapsed_s) noexcept;
  std::optional<Finding> check_base(const hal::RobotCommand& command, const hal::RobotSample& sample,
                                    double elapsed_s) noexcept;
  int suspect_wheel() const noexcept;

  ChecksOff off_;
  std::vector<Joint> joints_;
  std::optional<WheelAgreement> wheels_;
  std::optional<SenseVote> senses_;            // if the robot has a base
  std::optional<BaseDrivenBack> driven_back_;  // if it rolls
  struct Arm {
    RobotModel model;
    std::vector<OpposedMotion> joints;  // of all joints, in order: wheels also put in energy
  };
  std::optional<Arm> arm_;        // if the base has an arm
  double late_s_ = 0.0;           // since the last sample in time
  double without_steps_s_ = 0.0;  // since S3 last had enough regular samples
  double irregular_s_ = 0.0;      // of samples in time, since the last regular one
  double last_elapsed_s_ = 0.0;   // before the last sample
  bool regular_ = false;          // S3 may use the last sample
};

}  // namespace control
