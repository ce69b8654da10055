/// @file
/// What a drive could be asked next: experiments that youbot-bench has, with options that suit the drive.
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "identification/experiments/joint_experiment.h"
#include "identification/gap/gap.h"
#include "model/effects/drive_model.h"

namespace identification::gap {

struct BenchExperiment {
  std::string name;                                           ///< of the command: "staircase"
  std::vector<std::pair<std::string, std::string>> settings;  ///< other than its defaults, by key
  std::function<std::unique_ptr<experiments::JointExperiment>(double period_s)> make;
};

/// Slow and fast, by speed and by torque, at rest and in motion; none asks more speed or torque than that by
/// its own set-points. What a torque makes of the joint is left to see.
std::vector<BenchExperiment> bench_experiments(const model::effects::DriveModel& model,
                                               const DriveLimits& limits);

}  // namespace identification::gap
