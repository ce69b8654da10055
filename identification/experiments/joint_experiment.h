/// @file
/// Common interface of all experiments on one joint, for the program that runs them.
#pragma once
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <string>

#include "hal/joint.h"

namespace identification::experiments {

/// Maximum number of result values of one measurement.
inline constexpr std::size_t kMaxResults = 14;
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// A joint's measurements in one cycle. SI, joint side.
struct Reading {
  double time_s = 0.0;  ///< since the start of the measurement; time of sampling
  double position_rad = 0.0;
  double velocity_rad_per_s = 0.0;  ///< filtered from the position
  double torque_Nm = 0.0;           ///< motor current times constants, as measured
  double command_Nm = kUnknown;     ///< torque command that acted until now; unknown in velocity mode
};

/// Command of a joint until the next cycle.
struct SetPoint {
  hal::JointCommand command;
  double position_command_rad = 0.0;  ///< of a loop closed in the experiment, for the recording
};

/// Commands of an experiment that a recording contains in addition to torque, position and velocity.
struct RecordedCommands {
  bool torque = false;
  bool velocity = false;
  bool position = false;
};

/// A plan of numbered measurements on one joint, each starting from a joint that may still move:
///
///     experiment.begin(3, reading);                       // reading.time_s == 0
///     while (!experiment.finished()) set_point = experiment.step(reading);
///     experiment.write_result(values);
///
/// One object per joint, used by one thread. It uses neither clock nor files: the same object runs on a
/// robot, in a test and against a bare model. begin(), step(), finished() and write_result() are for the
/// cycle: no allocation, lock or exception. Constructors throw std::invalid_argument naming the value out of
/// range.
class JointExperiment {
 public:
  JointExperiment() = default;
  JointExperiment(const JointExperiment&) = delete;
  JointExperiment& operator=(const JointExperiment&) = delete;
  virtual ~JointExperiment() = default;

  virtual RecordedCommands recorded_commands() const noexcept = 0;
  virtual int measurement_count() const noexcept = 0;
  /// Maximum duration of that measurement for a joint that comes to rest in the available time.
  virtual double duration_s(int measurement) const noexcept = 0;

  virtual void begin(int measurement, const Reading& reading) noexcept = 0;
  /// After the end it stays at rest, while other joints finish.
  virtual SetPoint step(const Reading& reading) noexcept = 0;
  virtual bool finished() const noexcept = 0;

  /// Column names, with units, of the results of a finished measurement; at most kMaxResults. Empty if the
  /// recording is the only result.
  virtual std::span<const char* const> result_columns() const noexcept { return {}; }
  /// `values` has one entry per column. A value that could not be measured is NaN.
  virtual void write_result(std::span<double> /*values*/) const noexcept {}
  /// Setup: why the value of that column may be NaN, to follow the joint's name: "never moved up to 0.3 N·m".
  /// Empty if it is never NaN.
  virtual std::string not_measured(std::size_t /*column*/) const { return {}; }

  /// Waiting time of a measurement before its results depend on the velocity. The effects of earlier events,
  /// another measurement or an interruption, must have decayed by then. Infinite if results never depend on
  /// it.
  virtual double settle_s() const noexcept { return std::numeric_limits<double>::infinity(); }
};

}  // namespace identification::experiments
