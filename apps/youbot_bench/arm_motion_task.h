/// @file
/// Drives an arm on a tour of motions, and records them.
#pragma once
#include <array>
#include <chrono>
#include <span>
#include <vector>

#include "apps/youbot_bench/arm_motion_recording.h"
#include "apps/youbot_bench/arm_tour.h"
#include "apps/youbot_bench/joint_guard.h"
#include "control/state_variable_filter.h"
#include "hal/robot.h"
#include "runtime/loop.h"
#include "runtime/supervisor.h"
#include "runtime/task.h"

namespace youbot_bench {

/// Velocity commands, corrected by the error of position: the drives' own loops carry the weight, as in the
/// experiments on one joint. All other joints are held. A joint that is near its end stop, overloaded,
/// blocked or behind stops the tour; the arm is braked, then switched off. After a pause of the program
/// everything is switched off.
class ArmMotionTask final : public runtime::Task {
 public:
  struct Config : runtime::Supervisor::Config {
    Config() { rest_rad_per_s = 0.05; }
    bool wait_for_recording = false;  ///< for virtual time, which is faster than any disk
  };

  /// Indices of joints arm-1 to arm-5. @throws std::invalid_argument if the robot has no such arm.
  static std::array<std::size_t, control::kArmJoints> arm_joints(std::span<const hal::JointInfo> joints);

  /// The robot's joints and `recording` must outlive it. @throws as arm_joints().
  ArmMotionTask(const Config& config, const hal::Robot& robot, ArmTour tour, ArmMotionRecording& recording);

  void read(const runtime::Moment& moment) noexcept override;
  bool can_brake_after_pause(const runtime::Moment& /*moment*/) noexcept override { return false; }
  runtime::Verdict wait(const runtime::Moment& /*moment*/) noexcept override { return {}; }
  runtime::Verdict begin(const runtime::Moment& moment, hal::RobotCommand& command) noexcept override;
  runtime::Verdict step(const runtime::Moment& moment, hal::RobotCommand& command) noexcept override;
  runtime::Verdict brake(const runtime::Moment& moment, hal::RobotCommand& command,
                         double& fastest_rad_per_s) noexcept override;

  runtime::CycleTimes& record() noexcept { return times_; }
  const runtime::CycleTimes& record() const noexcept { return times_; }
  /// Share of the tour that is done.
  double progress() const noexcept { return time_s_ / tour_.duration_s(); }

 private:
  struct Joint {
    std::size_t index;
    control::StateVariableFilter filter;
    JointGuard guard;
    identification::experiments::Reading reading{};
  };
  runtime::StopReason watch(Joint& joint, double behind_rad, const hal::RobotCommand& sent) noexcept;

  Config config_;
  std::span<const hal::JointInfo> infos_;
  ArmTour tour_;
  ArmMotionRecording& recording_;
  std::vector<Joint> joints_;
  std::chrono::nanoseconds begin_{};
  double time_s_ = 0.0;
  ArmTour::State wanted_{};
  runtime::CycleTimes times_{};
};

using ArmMotionCycle = runtime::Supervised<ArmMotionTask>;

}  // namespace youbot_bench
