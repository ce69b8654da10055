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

/// What is to be measured.
struct ExperimentPlan {
  std::string name;    ///< "steady-state": also the directory of the recording
  std::string result;  ///< "steady-state-map": likewise, of the results
  /// Setup: the experiment for one joint. @throws std::invalid_argument.
  std::function<std::unique_ptr<identification::experiments::JointExperiment>(const hal::JointInfo&,
                                                                              double period_s)>
      make;
  std::string configuration;  ///< TOML text that makes it again; stored beside the recording
};

/// On what, where to, and how far it may go.
struct ExperimentOptions {
  std::vector<std::string> joints{};  ///< all measured at once; none named: all wheels
  std::filesystem::path directory;
  bool resume = false;
  bool virtual_time = false;
  bool quiet = false;
  bool allow_non_real_time = false;
  double record_rate_Hz = 1000.0;     ///< rounded to a whole number of cycles
  double max_speed_rad_per_s = 12.0;  ///< of a measured joint, filtered; beyond, the drives go off
  double max_travel_rad = 0.0;        ///< from where the measurement began; 0: no limit
  /// Where a joint with end stops is taken first; otherwise it begins where it stands.
  std::optional<double> start_rad{};
  double filter_cutoff_rad_per_s = 125.0;  ///< of the velocity
  std::chrono::nanoseconds period{1'000'000};
  std::chrono::nanoseconds enable_timeout{30'000'000'000};
  control::ChecksOff checks_off{};  ///< of the sensors
  runtime::RealTimeConfig real_time{};
};

struct ExperimentOutcome {
  int finished = 0;  ///< measurements on disk, those of earlier runs included
  int planned = 0;
  bool interrupted = false;
  std::string fault;                       ///< why the robot was stopped; empty when it was not
  std::filesystem::path frames;            ///< the last on the bus before the fault; empty without a bus
  std::vector<std::string> robot_report;   ///< see hal::Robot::report()
  std::vector<std::string> not_real_time;  ///< what the system refused
  control::ChecksOff once_silent_checks;   ///< of the sensors, that did not run for a while
  std::vector<std::string> recording_problems;
  std::vector<std::string> not_measured;  ///< results there are none of, and why; those of earlier runs, too
  std::chrono::nanoseconds robot_time{};
  std::chrono::nanoseconds wall_time{};
  std::uint64_t overruns = 0;  ///< periods skipped because a cycle was late
};

/// Waits until the drives obey, measures one after the other what is not on disk yet, brakes, switches off.
/// A fault, too much speed, travel or torque, a joint that is blocked, or a cycle that did not come for 0.1 s
/// switches the drives off at once; `stop`, a full disk and the end of the plan brake first. A joint with end
/// stops must have the room, torque and speed that the experiment will ask of it, is stopped before it
/// reaches the end of its range, and is braked first, whatever stops it but a fault. Then report.html is
/// written beside the recording; one that cannot be is among the recording's problems. `clock` is the one
/// `robot` was made with. Blocks.
/// @throws hal::SetupError, std::invalid_argument before anything moves (but for homing, where that is asked
/// for); the robot is then off, too.
ExperimentOutcome run_experiment(const ExperimentPlan& plan, const ExperimentOptions& options,
                                 hal::Robot& robot, hal::Clock& clock, const std::atomic<bool>& stop);

/// The same on a robot that it opens.
ExperimentOutcome run_experiment(const ExperimentPlan& plan, const ExperimentOptions& options,
                                 const runtime::RobotOptions& robot, const std::atomic<bool>& stop);

}  // namespace youbot_bench
