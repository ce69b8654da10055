/// @file
/// Recordings of a drive that its own servo moves: their input is a set-point.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "identification/gap/fitted_model.h"
#include "identification/gap/gap.h"
#include "model/effects/drive_model.h"

namespace identification::gap {

/// A recording with a set-point, from its first row to its last.
struct ServoRun {
  std::string name;
  model::ServoLaw law;  ///< with what the recording says of its own
  std::vector<double> time_s{};
  std::vector<double> goal_rad{};            ///< NaN without one
  std::vector<double> goal_rad_per_s{};      ///< likewise
  std::vector<double> position_rad{};        ///< measured
  std::vector<double> velocity_rad_per_s{};  ///< its derivative
  std::vector<double> enabled{};             ///< 0 where the servo makes no torque
};

/// The law of a recording: that of the model with the values of its comment lines `# servo.KEY: number`, the
/// keys of the model file's table [servo].
/// @throws std::invalid_argument naming the recording and an unknown key, or a value that is no number within
/// its bounds.
model::ServoLaw law_of(const Source& source, const model::ServoLaw& law);

/// The recordings that have position_rad and a set-point (position_command_rad, velocity_command_rad_per_s).
/// Their column servo_enabled, if they have one, is 0 where the servo is off.
std::vector<ServoRun> servo_runs(const std::vector<Source>& sources, const model::ServoLaw& law);

/// A recording without any torque gets the one by which its servo answers its set-point in the measured
/// motion, as torque_measured_Nm. @returns how many. @throws std::invalid_argument naming a recording that
/// has neither a torque nor a set-point.
std::size_t add_servo_torques(std::vector<Source>& sources, const model::ServoLaw& law);

/// The position of model and servo together at each row of a run, driven by the set-point only, from the
/// first row's state on; nothing is reset. Not finite if the simulation diverges.
std::vector<double> closed_loop_position_rad(const model::effects::DriveModel& model, const ServoRun& run);

/// Squared position errors of a run in stretches of a second, each divided by its rows.
std::vector<double> closed_loop_squares(const model::effects::DriveModel& model, const ServoRun& run);

/// The parameters of the drive for which model and servo together follow the runs best: least squares of the
/// position errors, from those of `fitted`. The recording of the torque stays.
/// [output-error method; L. Ljung, System Identification, 2nd ed., 1999, 4.2]
FittedModel refined_in_closed_loop(const FittedModel& fitted, const Rows& rows,
                                   const std::vector<ServoRun>& runs);

/// Errors of the simulated position.
ClosedLoopError closed_loop_error(const model::effects::DriveModel& model, const ServoRun& run);

}  // namespace identification::gap
