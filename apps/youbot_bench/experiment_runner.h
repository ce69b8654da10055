/// @file
/// Runs an experiment on a robot: the one loop of all experiments.
#pragma once
#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "control/plausibility/checks.h"
#include "hal/clock.h"
#include "hal/robot.h"
#include "identification/experiments/joint_experiment.h"
#include "runtime/open_robot.h"
#include "runtime/real_time.h"

namespace youbot_bench {

/// Description of the measurements.
struct ExperimentPlan {
  std::string name;    ///< "steady-state": also the directory of the recording
  std::string result;  ///< "steady-state-map": likewise, of the results
  /// Setup: the experiment for one joint. @throws std::invalid_argument.
  std::function<std::unique_ptr<identification::experiments::JointExperiment>(const hal::JointInfo&,
                                                                              double period_s)>
      make;
  std::string configuration;  ///< TOML text that reproduces it; stored with the recording
};

/// Robot, destination and limits.
struct ExperimentOptions {
  std::vector<std::string> joints{};  ///< all measured at once; empty: all wheels
  std::filesystem::path directory;
  bool resume = false;
  bool virtual_time = false;
  bool quiet = false;
  bool allow_non_real_time = false;
  double record_rate_Hz = 1000.0;     ///< rounded to a whole number of cycles
  double max_speed_rad_per_s = 12.0;  ///< of a measured joint, filtered; above, the drives are switched off
  double max_travel_rad = 0.0;        ///< from the start of the measurement; 0: no limit
  /// Position to which a joint with end stops is moved first; otherwise it starts at its position.
  std::optional<double> start_rad{};
  double filter_cutoff_rad_per_s = 125.0;  ///< of the velocity
  std::chrono::nanoseconds period{1'000'000};
  std::chrono::nanoseconds enable_timeout{30'000'000'000};
  control::ChecksOff checks_off{};  ///< of the sensors
  runtime::RealTimeConfig real_time{};
};

struct ExperimentOutcome {
  int finished = 0;  ///< measurements on disk, including those of earlier runs
  int planned = 0;
  bool interrupted = false;
  std::string fault;                       ///< why the robot was stopped; empty if it was not
  std::filesystem::path frames;            ///< the last frames on the bus before the fault; empty without a
                                           ///< bus
  std::vector<std::string> robot_report;   ///< see hal::Robot::report()
  std::vector<std::string> not_real_time;  ///< refused by the system
  control::ChecksOff once_silent_checks;   ///< of the sensors: those that did not run for a while
  std::vector<std::string> recording_problems;
  std::vector<std::string> not_measured;  ///< missing results with reasons, including those of earlier runs
  std::chrono::nanoseconds robot_time{};
  std::chrono::nanoseconds wall_time{};
  std::uint64_t overruns = 0;  ///< periods skipped because a cycle was late
};

/// Waits until the drives obey, performs the measurements that are not on disk yet, brakes, switches off. A
/// fault, excessive speed, travel or torque, a blocked joint, or a cycle that is late by 0.1 s switches the
/// drives off at once; `stop`, a full disk and the end of the plan brake first. A joint with end stops must
/// have the travel, torque and speed that the experiment needs; it is stopped before it reaches the end of
/// its range, and is braked first for any reason except a fault. Then report.html is written with the
/// recording; a failure to write it is added to the recording's problems. `clock` must be the one `robot` was
/// made with. Blocks.
/// @throws hal::SetupError, std::invalid_argument before anything moves (except for homing, if requested);
/// the robot is then off, too.
ExperimentOutcome run_experiment(const ExperimentPlan& plan, const ExperimentOptions& options,
                                 hal::Robot& robot, hal::Clock& clock, const std::atomic<bool>& stop);

/// The same with a robot that it opens.
ExperimentOutcome run_experiment(const ExperimentPlan& plan, const ExperimentOptions& options,
                                 const runtime::RobotOptions& robot, const std::atomic<bool>& stop);

}  // namespace youbot_bench
