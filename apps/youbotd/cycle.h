/// @file
/// One control cycle of the base: exchange with the robot, decide, compute the next command.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <limits>
#include <string>

#include "apps/common/monitored_robot.h"
#include "apps/youbotd/cycle_record.h"
#include "apps/youbotd/motion_source.h"
#include "apps/youbotd/recent_pause.h"
#include "apps/youbotd/sample_clock.h"
#include "control/base_controller.h"
#include "control/reference_limiter.h"
#include "control/speed_proof.h"
#include "control/torque_rate.h"
#include "control/workspace.h"
#include "hal/robot.h"

namespace youbotd {

/// Why the robot stopped before its motion was finished. The first one is kept.
struct StopReason {
  enum class Kind : std::uint8_t {
    kNone,
    kRobotFault,      ///< what `status` says
    kNotEnabled,      ///< the drives did not start to obey in time
    kCommandTimeout,  ///< set-points stopped coming
    kStalled,         ///< this loop itself did not run
    kOverspeed,       ///< wheel `joint` turned faster than allowed
    kNotAtRest,       ///< braking did not bring the base to rest
    kBehind,          ///< the base was too far from its reference
    kTurnedBehind,    ///< likewise turned
    kOutside,         ///< the base left its workspace
  };
  Kind kind = Kind::kNone;
  std::uint64_t cycle = 0;
  int joint = -1;
  std::chrono::nanoseconds time{};  ///< of that cycle, as in the recording
  double value = 0.0;  ///< rad/s; m or rad off; or s: since the last set-point or cycle, or waited
  double limit = 0.0;  ///< of `value`, where the configuration sets one
  hal::CycleStatus status{};
  std::chrono::nanoseconds pause{};  ///< of this loop, just before a fault of the robot
  explicit operator bool() const noexcept { return kind != Kind::kNone; }
};

/// "cycle 1200 (1.199 s): wheel-2 turned at 14.1 rad/s, more than allowed (limits.wheel_speed_rad_per_s =
/// 12); drives switched off".
std::string describe(const StopReason& reason, const hal::Robot& robot);

/// A state machine around control::BaseController:
///   kStarting → kRunning → kStopping → kOff,   any → kFaulted → finished.
/// A fault switches the drives off at once. A set-point that is too old, a loop that did not run for as
/// long, or a base that is too far from its reference brakes first, as the robot can still be trusted. A
/// shorter pause stops nothing, nor do samples that did not come for some cycles, and what came to pass
/// meanwhile is an overspeed when it was one, and only then. There is no way back: motion after a stop needs
/// a new start. One thread. step() is the cycle: no allocation, lock, exception, blocking call or logging.
class Cycle {
 public:
  struct Config {
    control::BaseController::Config controller;
    std::chrono::nanoseconds period{1'000'000};
    std::chrono::nanoseconds command_timeout{100'000'000};
    /// Commutation takes up to 5 s a motor controller, a hot winding 14 s to cool.
    std::chrono::nanoseconds enable_timeout{30'000'000'000};
    double wheel_speed_limit_rad_per_s = 12.0;
    control::ChecksOff checks_off{};  ///< of the sensors
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

  /// `robot` and `motion` outlive the cycle; so does `truth`, the simulated
  /// base's pose or null.
  /// @throws std::invalid_argument from the controller's configuration, or when the robot has no four wheels.
  Cycle(const Config& config, hal::Robot& robot, MotionSource& motion, const control::PlanarPose* truth);

  void step(std::chrono::nanoseconds now) noexcept;
  /// Comes to rest, then switches off. From the cycle's thread.
  void request_stop() noexcept;
  /// Drives off with the next step. From the cycle's thread.
  void switch_off() noexcept;

  bool finished() const noexcept;
  control::ChecksOff silent_checks() const noexcept { return robot_.silent_checks(); }
  control::ChecksOff once_silent_checks() const noexcept { return robot_.once_silent_checks(); }
  CycleRecord& record() noexcept { return record_; }  ///< of the last step()
  const CycleRecord& record() const noexcept { return record_; }
  const StopReason& stop_reason() const noexcept { return stop_reason_; }

 private:
  void run(std::chrono::nanoseconds now, const control::WheelVector& position_rad, double elapsed_s) noexcept;
  control::BaseReference limit(const control::BaseReference& wanted_W, std::chrono::nanoseconds now) noexcept;
  void check_workspace(std::chrono::nanoseconds now) noexcept;
  void check_following(const control::PlanarPose& reference_W, std::chrono::nanoseconds now) noexcept;
  void brake(std::chrono::nanoseconds now, const control::WheelVector& position_rad,
             double elapsed_s) noexcept;
  void apply(const control::BaseController::Output& output) noexcept;
  void keep_record(const control::BaseController::Output& output) noexcept;
  void enter(Phase phase, std::chrono::nanoseconds now) noexcept;
  void fail(StopReason reason, std::chrono::nanoseconds now) noexcept;
  void keep(StopReason reason) noexcept;

  Config config_;
  apps::MonitoredRobot robot_;
  MotionSource& motion_;
  const control::PlanarPose* truth_;
  control::BaseController controller_;

  control::ReferenceLimiter reference_limiter_;
  std::chrono::nanoseconds last_reference_{};
  std::array<control::TorqueRate, kWheels> torque_rates_;
  std::array<control::SpeedProof, kWheels> speed_proofs_;

  hal::RobotCommand command_;
  hal::RobotSample sample_;
  SampleClock sample_clock_;
  RecentPause pause_;
  CycleRecord record_;
  StopReason stop_reason_;
  Phase phase_ = Phase::kStarting;
  std::chrono::nanoseconds phase_begin_{};
  std::chrono::nanoseconds last_motion_{};  // while stopping
  std::chrono::nanoseconds followed_{};     // when the base was last near its reference
  std::chrono::nanoseconds first_{};
  std::chrono::nanoseconds now_{};
  control::PlanarPose X_WB_;  // odometry of the last cycle
  bool obeyed_ = false;       // the drives, at least once: it counts from then on
  double may_be_outside_m_;
  std::uint64_t count_ = 0;
};

}  // namespace youbotd
