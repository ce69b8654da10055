/// @file
/// Monitors a joint while an experiment moves it.
#pragma once
#include <cstdint>

#include "hal/robot.h"
#include "identification/experiments/joint_experiment.h"
#include "identification/experiments/low_pass.h"

namespace youbot_bench {

/// Cycle: all but construction.
class JointGuard {
 public:
  enum class Trip : std::uint8_t {
    kNone,
    kNearStop,  ///< it could no longer be stopped before the end of its range
    kTorque,    ///< it takes more torque than its rating
    kBlocked,   ///< it is pushed and does not move
  };

  JointGuard(const hal::JointInfo& joint, double period_s) noexcept;

  /// In each cycle of a measurement, with the command that has acted.
  Trip watch(const identification::experiments::Reading& reading, const hal::JointCommand& command) noexcept;
  /// Low-passed, as used for the checks.
  double torque_Nm() const noexcept { return torque_.value(); }

 private:
  bool near_stop(const identification::experiments::Reading& reading) const noexcept;
  bool blocked(const identification::experiments::Reading& reading,
               const hal::JointCommand& command) noexcept;

  hal::JointRange range_;
  double rated_torque_Nm_;
  double blocked_torque_Nm_;
  double period_s_;
  identification::experiments::LowPass torque_;
  double pushed_hard_s_ = 0.0;  // without motion
  double asked_to_turn_s_ = 0.0;
};

}  // namespace youbot_bench
