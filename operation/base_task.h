/// @file
/// The base follows a motion: a path, a velocity, or its current position.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <limits>

#include "control/base_controller.h"
#include "control/reference_limiter.h"
#include "control/speed_proof.h"
#include "control/torque_rate.h"
#include "control/workspace.h"
#include "hal/robot.h"
#include "operation/cycle_record.h"
#include "operation/motion_source.h"
#include "runtime/sample_clock.h"
#include "runtime/supervisor.h"
#include "runtime/task.h"

namespace operation {

/// Wraps control::BaseController. A set-point that is too old, a pause of the program, or a base that is too
/// far from its reference brakes, because the robot can still be trusted. A shorter pause or some missing
/// samples stop nothing; overspeed is evaluated on the mean velocity over the gap.
class BaseTask final : public runtime::Task {
 public:
  struct Config : runtime::Supervisor::Config {
    control::BaseController::Config controller;
    double wheel_speed_limit_rad_per_s = 12.0;
    /// Per second, relative to the maximum torque of a joint's drive. Braking is not limited.
    double torque_rate_per_s = control::kTorqueRate_per_s;
    /// For the reference, whatever its source.
    control::ReferenceLimiter::Config setpoint;
    /// The base may be this far from its reference; if it is further for kFollowingTime, it is stopped
    /// (window and time-out of a following error in CiA 402, objects 6065h and 6066h). A path does not wait
    /// for a blocked base: it would arrive late and report success. The base does not jump when it is
    /// released: the reference is ahead by at most this limit and the way of that time. Of all runs that
    /// follow, one without friction compensation has the largest error, 55 mm and 0.14 rad; the reference of
    /// a velocity waits at two thirds of the limit. Infinite: no limit.
    double following_error_m = 0.15;
    double following_error_rad = 0.3;
    /// For a simulation that shows how large the error of the base gets.
    void allow_any_following_error() noexcept {
      following_error_m = following_error_rad = std::numeric_limits<double>::infinity();
    }
    control::Workspace workspace;  ///< only the base's part is used
    control::PlanarPose start{};   ///< X_WB when the drives start to obey
  };
  static constexpr std::chrono::milliseconds kFollowingTime{200};

  /// `motion` must outlive the task, and so must `truth`, the simulated base's pose or null.
  /// @throws std::invalid_argument from the controller's configuration, or if the robot does not have four
  /// wheels.
  BaseTask(const Config& config, const hal::Robot& robot, MotionSource& motion,
           const control::PlanarPose* truth);

  void read(const runtime::Moment& moment) noexcept override;
  bool can_brake_after_pause(const runtime::Moment& moment) noexcept override;
  runtime::Verdict wait(const runtime::Moment& moment) noexcept override;
  runtime::Verdict begin(const runtime::Moment& moment, hal::RobotCommand& command) noexcept override;
  runtime::Verdict step(const runtime::Moment& moment, hal::RobotCommand& command) noexcept override;
  runtime::Verdict brake(const runtime::Moment& moment, hal::RobotCommand& command,
                         double& fastest_rad_per_s) noexcept override;

  CycleRecord& record() noexcept { return record_; }  ///< of the last cycle
  const CycleRecord& record() const noexcept { return record_; }

 private:
  control::BaseReference limit(const control::BaseReference& wanted_W, std::chrono::nanoseconds now) noexcept;
  runtime::StopReason too_far(const control::PlanarPose& reference_W, std::chrono::nanoseconds now) noexcept;
  runtime::StopReason outside() const noexcept;
  runtime::Verdict apply(const control::BaseController::Output& output, bool running,
                         hal::RobotCommand& command) noexcept;
  void keep_record(const control::BaseController::Output& output) noexcept;

  Config config_;
  MotionSource& motion_;
  const control::PlanarPose* truth_;
  control::BaseController controller_;
  control::ReferenceLimiter reference_limiter_;
  std::chrono::nanoseconds last_reference_{};
  std::array<control::TorqueRate, kWheels> torque_rates_;
  std::array<control::SpeedProof, kWheels> speed_proofs_;
  runtime::SampleClock sample_clock_;
  std::size_t joints_;
  control::WheelVector position_rad_ = control::WheelVector::Zero();
  double elapsed_s_ = 0.0;  // between the last two samples
  CycleRecord record_;
  std::chrono::nanoseconds followed_{};  // when the base was last close to its reference
  control::PlanarPose X_WB_;             // odometry of the last cycle
  bool obeyed_ = false;                  // the drives have obeyed at least once: the pose is valid from then
                                         // on
  double may_be_outside_m_;
};

using Cycle = runtime::Supervised<BaseTask>;

}  // namespace operation
