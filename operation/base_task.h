/// @file
/// The base follows a motion: a path, a velocity, or the place where it stands.
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

/// Around control::BaseController. A set-point that is too old, a pause of the program, or a base that is too
/// far from its reference brakes, as the robot can still be trusted. A shorter pause stops nothing, nor do
/// samples that did not come for some cycles, and what came to pass meanwhile is an overspeed when it was
/// one, and only then.
class BaseTask final : public runtime::Task {
 public:
  struct Config : runtime::Supervisor::Config {
    control::BaseController::Config controller;
    double wheel_speed_limit_rad_per_s = 12.0;
    /// Of what a joint's drive can deliver, a second. Braking is not slowed down.
    double torque_rate_per_s = control::kTorqueRate_per_s;
    /// Of the reference, whatever asks for it.
    control::ReferenceLimiter::Config setpoint;
    /// The base may be this far from its reference; further for kFollowingTime, it is stopped (the window
    /// and time-out of a following error in CiA 402, objects 6065h and 6066h). A path does not wait for a
    /// base that is held: it would arrive late and report success. Nor does it dart when it is let go: the
    /// reference is ahead by no more than this limit and the way of that time. Of all runs that do follow,
    /// one without friction compensation is furthest off, 55 mm and 0.14 rad; the reference of a velocity
    /// waits at two thirds of it. Infinite: no limit.
    double following_error_m = 0.15;
    double following_error_rad = 0.3;
    /// For a simulation that is to show how far off the base gets.
    void allow_any_following_error() noexcept {
      following_error_m = following_error_rad = std::numeric_limits<double>::infinity();
    }
    control::Workspace workspace;  ///< of which the base's matters here
    control::PlanarPose start{};   ///< X_WB when the drives begin to obey
  };
  static constexpr std::chrono::milliseconds kFollowingTime{200};

  /// `motion` outlives the task; so does `truth`, the simulated base's pose or null.
  /// @throws std::invalid_argument from the controller's configuration, or when the robot has no four wheels.
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
  std::chrono::nanoseconds followed_{};  // when the base was last near its reference
  control::PlanarPose X_WB_;             // odometry of the last cycle
  bool obeyed_ = false;                  // the drives, at least once: it counts from then on
  double may_be_outside_m_;
};

using Cycle = runtime::Supervised<BaseTask>;

}  // namespace operation
