/// @file
/// Candidates for the next measurement: experiments of youbot-bench, with options that suit the drive.
#pragma once
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "identification/experiments/joint_experiment.h"
#include "identification/gap/gap.h"
#include "model/effects/drive_model.h"

namespace identification::gap {

/// Limits at which youbot-bench stops an experiment: speed, or travel in one measurement.
struct BenchStops {
  double speed_rad_per_s = std::numeric_limits<double>::infinity();
  double travel_rad = std::numeric_limits<double>::infinity();
};

struct BenchExperiment {
  std::string name;                                           ///< of the command: "staircase"
  std::vector<std::pair<std::string, std::string>> settings;  ///< other than its defaults, by key
  std::function<std::unique_ptr<experiments::JointExperiment>(double period_s)> make;
  BenchStops stops{};  ///< with these settings
};

/// Slow and fast, by speed and by torque, at rest and in motion. No set-point exceeds the limits;
/// carried_out() determines the speed that a torque causes.
std::vector<BenchExperiment> bench_experiments(const model::effects::DriveModel& model,
                                               const DriveLimits& limits);

}  // namespace identification::gap
