/// @file
/// Judges whether a robot's sensors can be believed: each joint by itself, the four wheels together.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "control/plausibility/checks.h"
#include "control/plausibility/hall_agreement.h"
#include "control/plausibility/opposed_motion.h"
#include "control/plausibility/sample_time.h"
#include "control/plausibility/still_encoder.h"
#include "control/plausibility/torque_agreement.h"
#include "control/plausibility/velocity_agreement.h"
#include "control/plausibility/velocity_step.h"
#include "control/plausibility/wheel_agreement.h"
#include "control/robot_model.h"
#include "hal/robot.h"

namespace control {

/// Every limit of speed, distance and force is judged by a sensor; a sensor that lies takes the limit with
/// it. Each check compares two things that do not come from the same place. docs/safety.md has their
/// detection times and what none of them sees.
/// One thread. Cycle: all but construction.
class PlausibilityMonitor {
 public:
  struct Finding {
    hal::JointFault fault = hal::JointFault::kNone;
    int joint = -1;  ///< -1: one of the wheels, and it is not clear which
  };

  /// Whether the wheels carry the robot, and so turn together, or each turns by itself in the air.
  enum class Wheels { kRolling, kFree };

  /// Joints called "wheel-…" are wheels; the first four of them, if they are the robot's first four joints,
  /// are a mecanum base. The weight of an arm behind it is that of robot_model.h.
  PlausibilityMonitor(std::span<const hal::JointInfo> joints, Wheels wheels, const ChecksOff& off = {});

  void restart() noexcept;
  /// Once a cycle while the drives obey. `elapsed_s`: from the last sample's stamp to this one's, 0: no new
  /// one came.
  std::optional<Finding> update(const hal::RobotCommand& command, const hal::RobotSample& sample,
                                double elapsed_s) noexcept;

  /// The checks that have judged nothing for the last second, as too few samples came in time for them, or no
  /// reading of a joint's Hall sensors. Not S3 where no two samples are near enough: of such a robot
  /// hal::Robot::notes() reports it.
  ChecksOff silent() const noexcept;

 private:
  struct Joint {
    StillEncoder still;
    VelocityAgreement velocity;
    TorqueAgreement torque;
    VelocityStep step;
    HallAgreement hall{};
  };
  hal::JointFault check(Joint& joint, const hal::JointCommand& command, const hal::JointSample& sample,
                        const SampleTime& time) const noexcept;

  std::optional<Finding> check_arm(const hal::RobotCommand& command, const hal::RobotSample& sample,
                                   const SampleTime& time) noexcept;

  ChecksOff off_;
  std::vector<Joint> joints_;
  std::optional<WheelAgreement> wheels_;
  struct Arm {
    RobotModel model;
    std::vector<OpposedMotion> joints;  // of all, in their order: wheels put energy in, too
  };
  std::optional<Arm> arm_;        // of a base with one
  double late_s_ = 0.0;           // since the last sample that came in time
  double without_steps_s_ = 0.0;  // since S3 last had enough regular samples
  double irregular_s_ = 0.0;      // of samples in time, since the last one that came regularly
  double last_elapsed_s_ = 0.0;   // before the last sample
  bool regular_ = false;          // the last sample is one that S3 may use
};

}  // namespace control
