/// @file
/// Recordings of the hidden plant, as from a test bench.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "identification/experiments/joint_experiment.h"
#include "identification/recording.h"
#include "tests/gap/hidden_plant.h"

namespace gap_test {

enum class Experiment : std::uint8_t {
  kStaircase,    ///< constant speeds, up and down, both directions
  kMultisine,    ///< of velocity, and a faster one of torque on top
  kTorqueRamp,   ///< slowly through break-away, both directions
  kReversals,    ///< triangles of velocity
  kPresliding,   ///< sines of torque that do not break away, after a short slide
  kRandomSteps,  ///< of velocity
};
std::string_view name_of(Experiment experiment);

struct Drive {
  Plant plant;
  HiddenEffects effects;
  Sensors sensors;
};
double breakaway_Nm(const Drive& drive);
struct Run {
  Experiment experiment = Experiment::kStaircase;
  double duration_s = 20;
  double top_rad_per_s = 8;
  std::uint64_t seed = 1;
  double running_s = 0;  ///< warm-up before it
  /// Breakaway assumed by the bench; 0: the true one.
  double breakaway_Nm = 0;
};

struct Simulated {
  identification::Recording recording;
  std::vector<double> torque_Nm;                       ///< the motor's, before the sensor
  std::array<double, kHiddenKinds> contribution_Nm{};  ///< rms
  double motor_work_J = 0;
  double friction_heat_J = 0;
  double kinetic_J = 0;
};
/// Row k: a command from its time on, and the sensor values within the millisecond that it held.
Simulated simulate(const Drive& drive, const Run& run);

struct Row {
  double time_s;
  double command_Nm;
  double measured_Nm;
  double position_rad;
};
/// One run after another on a drive that keeps turning, row by row: for recordings of any length. Plant and
/// its noise use the first run's seed.
void simulate(const Drive& drive, std::span<const Run> runs, const std::function<void(const Row&)>& take);
/// The same for an experiment of the library, whose velocity commands are followed by a loop of the bench.
identification::Recording carry_out(const Drive& drive,
                                    identification::experiments::JointExperiment& experiment,
                                    std::uint64_t seed);

/// rms over several, weighted by their lengths.
double contribution_Nm(const std::vector<Simulated>& runs, Hidden kind);

}  // namespace gap_test
