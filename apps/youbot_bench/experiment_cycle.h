/// @file
/// One control cycle of an experiment: exchange with the robot, judge, hand out records and set-points.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/monitored_robot.h"
#include "apps/youbot_bench/experiment_recording.h"
#include "apps/youbot_bench/joint_fit.h"
#include "apps/youbot_bench/joint_guard.h"
#include "control/state_variable_filter.h"
#include "hal/robot.h"
#include "identification/experiments/joint_experiment.h"

namespace youbot_bench {

/// Why an experiment did not come to its end. The first one is kept.
struct ExperimentStop {
  enum class Kind : std::uint8_t {
    kNone,
    kRobotFault,  ///< what `status` says
    kNotEnabled,  ///< the drives did not start to obey in time
    kNotObeying,  ///< the drives went off by themselves
    kStalled,     ///< this program did not run for `value` s
    kOverspeed,   ///< `joint` turned at `value` rad/s
    kTooFar,      ///< `joint` moved by `value` rad since the measurement began
    kNotAtRest,   ///< braking left `value` rad/s
    kMisfit,      ///< nothing moved: `misfit` says why
    kNearStop,    ///< `joint` came so near the end of its range, at `value` rad, that it had to be stopped
    kTorque,      ///< `joint` took `value` N·m, more than it is made for
    kBlocked,     ///< `joint` took `value` N·m and did not turn
    kNotPlaced,   ///< `joint` did not reach the place where it was to begin in time; it is at `value` rad
  };
  Kind kind = Kind::kNone;
  int joint = -1;  ///< of the robot
  int measurement = 0;
  std::chrono::nanoseconds time{};  ///< since the first cycle
  double value = 0.0;
  hal::CycleStatus status{};
  Misfit misfit{};
  explicit operator bool() const noexcept { return kind != Kind::kNone; }
};

/// "measurement 3, 12.301 s: wheel-2 turned at 14.1 rad/s, more than --max-speed; drives switched off".
std::string describe(const ExperimentStop& stop, const hal::Robot& robot);

/// kStarting → kPlacing → kMeasuring → kBraking → kOff;   any → kFaulted → finished.
/// kPlacing takes a joint to where its experiment is to begin. Where none is to go anywhere it is left out.
/// All chosen joints do the same measurement at once; the next begins when the last joint has finished. What
/// is too fast, too far, blocked or overloaded is switched off at once; a joint with end stops is braked
/// first and held until it rests: it belongs to an arm, which falls without torque. One thread. step() is the
/// cycle: no allocation, lock, exception or blocking call.
class ExperimentCycle {
 public:
  struct Config {
    std::chrono::nanoseconds period{1'000'000};
    std::chrono::nanoseconds enable_timeout{30'000'000'000};
    double max_speed_rad_per_s = 12.0;
    double max_travel_rad = 0.0;  ///< 0: no limit
    double filter_cutoff_rad_per_s = 125.0;
    int cycles_per_row = 1;
    int first_measurement = 0;
    double first_time_s = 0.0;        ///< of the recording
    bool wait_for_recording = false;  ///< for virtual time, which is faster than any disk
    control::ChecksOff checks_off{};  ///< of the sensors
  };
  struct Joint {
    std::size_t index;  ///< in Robot::joints()
    std::unique_ptr<identification::experiments::JointExperiment> experiment;
    std::optional<JointFit> fit{};  ///< of a joint that has end stops
  };

  /// `robot` and `recording` outlive the cycle. @throws std::invalid_argument from the velocity filter.
  ExperimentCycle(const Config& config, hal::Robot& robot, std::vector<Joint> joints,
                  ExperimentRecording& recording);

  void step(std::chrono::nanoseconds now) noexcept;
  /// Comes to rest, then switches off. From the cycle's thread.
  void request_stop() noexcept;
  bool finished() const noexcept;

  control::ChecksOff once_silent_checks() const noexcept { return robot_.once_silent_checks(); }
  const ExperimentStop& stop() const noexcept { return stop_; }
  /// Setup: why the experiment does not fit, in words; empty when it does.
  std::string misfit() const;
  int measurement() const noexcept { return measurement_; }
  /// Into the measurement under way.
  double measurement_time_s() const noexcept { return reading_time_s_; }

 private:
  enum class Phase : std::uint8_t { kStarting, kPlacing, kMeasuring, kBraking, kFaulted, kOff };
  struct Channel {
    Joint joint;
    control::StateVariableFilter filter;
    JointGuard guard;
    double max_speed_rad_per_s;
    identification::experiments::Reading reading{};
    double start_rad = 0.0;  ///< where it is to begin
    double position_command_rad = 0.0;
    double origin_rad = 0.0;  ///< where it was when the measurement began
    double torque_sum_Nm = 0.0;
  };
  void start() noexcept;
  void place() noexcept;
  void begin_measuring() noexcept;
  bool fits() noexcept;
  void sense() noexcept;
  void measure() noexcept;
  bool watch(Channel& channel) noexcept;
  bool goes_too_far(const Channel& channel) const noexcept;
  hal::JointCommand bounded(const Channel& channel, hal::JointCommand wanted) const noexcept;
  void begin_measurement() noexcept;
  void record_row() noexcept;
  void record_results() noexcept;
  void push() noexcept;
  void brake() noexcept;
  void enter(Phase phase) noexcept;
  void keep(ExperimentStop stop) noexcept;
  void fail(const ExperimentStop& stop) noexcept;
  void halt(const ExperimentStop& stop) noexcept;

  Config config_;
  apps::MonitoredRobot robot_;
  ExperimentRecording& recording_;
  std::vector<Channel> channels_;
  int measurement_count_;
  bool has_end_stops_ = false;
  Phase phase_ = Phase::kStarting;
  int measurement_;
  bool started_ = false;
  std::chrono::nanoseconds first_{};
  std::chrono::nanoseconds now_{};
  std::chrono::nanoseconds phase_begin_{};
  std::chrono::nanoseconds measuring_since_{};
  std::chrono::nanoseconds measurement_begin_{};
  std::chrono::nanoseconds last_motion_{};
  double reading_time_s_ = 0.0;
  int cycles_since_row_ = 0;
  hal::RobotCommand command_{};
  hal::RobotCommand applied_{};  // of the exchange before
  hal::RobotSample sample_{};
  ExperimentRecord record_{};
  ExperimentStop stop_{};
};

}  // namespace youbot_bench
