/// @file
/// An experiment on one or several joints: moves them to their start positions, measures, and monitors them.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/youbot_bench/experiment_recording.h"
#include "apps/youbot_bench/joint_fit.h"
#include "apps/youbot_bench/joint_guard.h"
#include "control/state_variable_filter.h"
#include "hal/robot.h"
#include "identification/experiments/joint_experiment.h"
#include "runtime/loop.h"
#include "runtime/supervisor.h"
#include "runtime/task.h"

namespace youbot_bench {

/// Moves a joint with end stops to the start of its experiment, then measures. All chosen joints do the same
/// measurement at once; the next one starts when the last joint has finished. A joint that is too fast, too
/// far, blocked or overloaded is switched off at once; a joint with end stops is braked first and held until
/// it rests, because it belongs to an arm, which falls without torque. After a pause of the program
/// everything is switched off.
class ExperimentTask final : public runtime::Task {
 public:
  struct Config : runtime::Supervisor::Config {
    Config() {
      rest_rad_per_s = 0.05;
      wheels = control::PlausibilityMonitor::Wheels::kFree;
    }
    double max_speed_rad_per_s = 12.0;
    double max_travel_rad = 0.0;  ///< 0: no limit
    double filter_cutoff_rad_per_s = 125.0;
    int cycles_per_row = 1;
    int first_measurement = 0;
    double first_time_s = 0.0;        ///< of the recording
    bool wait_for_recording = false;  ///< for virtual time, which is faster than any disk
  };
  struct Joint {
    std::size_t index;  ///< in Robot::joints()
    std::unique_ptr<identification::experiments::JointExperiment> experiment;
    std::optional<JointFit> fit{};  ///< for a joint with end stops
  };

  /// The robot's joints and `recording` must outlive it. @throws std::invalid_argument from the velocity
  /// filter.
  ExperimentTask(const Config& config, const hal::Robot& robot, std::vector<Joint> joints,
                 ExperimentRecording& recording);

  void read(const runtime::Moment& moment) noexcept override;
  bool can_brake_after_pause(const runtime::Moment& /*moment*/) noexcept override { return false; }
  runtime::Verdict wait(const runtime::Moment& /*moment*/) noexcept override { return {}; }
  runtime::Verdict begin(const runtime::Moment& moment, hal::RobotCommand& command) noexcept override;
  runtime::Verdict step(const runtime::Moment& moment, hal::RobotCommand& command) noexcept override;
  runtime::Verdict brake(const runtime::Moment& moment, hal::RobotCommand& command,
                         double& fastest_rad_per_s) noexcept override;

  runtime::CycleTimes& record() noexcept { return times_; }
  const runtime::CycleTimes& record() const noexcept { return times_; }
  /// Setup: why the experiment does not fit; empty if it does.
  std::string misfit() const;
  int measurement() const noexcept { return measurement_; }
  /// Time since the start of the current measurement.
  double measurement_time_s() const noexcept { return reading_time_s_; }

 private:
  struct Channel {
    Joint joint;
    control::StateVariableFilter filter;
    JointGuard guard;
    double max_speed_rad_per_s;
    identification::experiments::Reading reading{};
    double start_rad = 0.0;  ///< start position
    double position_command_rad = 0.0;
    double origin_rad = 0.0;  ///< position at the start of the measurement
    double torque_sum_Nm = 0.0;
  };
  void sense(const runtime::Moment& moment) noexcept;
  bool fits(const hal::RobotSample& sample) noexcept;
  runtime::Verdict place(const runtime::Moment& moment, hal::RobotCommand& command) noexcept;
  void begin_measuring(std::chrono::nanoseconds now) noexcept;
  void begin_measurement(std::chrono::nanoseconds now) noexcept;
  runtime::Verdict measure(const runtime::Moment& moment, hal::RobotCommand& command) noexcept;
  runtime::StopReason watch(Channel& channel, const hal::RobotCommand& sent) noexcept;
  bool goes_too_far(const Channel& channel) const noexcept;
  hal::JointCommand bounded(const Channel& channel, hal::JointCommand wanted,
                            const hal::RobotCommand& sent) const noexcept;
  runtime::Verdict stop(const runtime::StopReason& reason) noexcept;
  void record_row(const runtime::Moment& moment) noexcept;
  void record_results(std::chrono::nanoseconds now) noexcept;
  void push() noexcept;

  Config config_;
  std::span<const hal::JointInfo> joints_;
  ExperimentRecording& recording_;
  std::vector<Channel> channels_;
  int measurement_count_;
  bool has_end_stops_ = false;
  bool measuring_ = false;  // otherwise on the way to the start position
  bool pressed_ = false;    // against an obstacle, when it was stopped
  Misfit misfit_{};
  const Channel* misfit_of_ = nullptr;
  int measurement_;
  std::chrono::nanoseconds placing_since_{};
  std::chrono::nanoseconds measuring_since_{};
  std::chrono::nanoseconds measurement_begin_{};
  double reading_time_s_ = 0.0;
  int cycles_since_row_ = 0;
  ExperimentRecord record_{};
  runtime::CycleTimes times_{};
};

using ExperimentCycle = runtime::Supervised<ExperimentTask>;

}  // namespace youbot_bench
