/// @file
/// The torque that a model does not predict, as recordings.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "identification/gap/measured_gap.h"
#include "identification/robot_gap/measured_arm.h"
#include "runtime/configuration/robot_file.h"

namespace analysis {

/// One CSV for each recording, or stretch of one, in `directory`: time, motion, the torque that acted, the
/// prediction and their difference, all in the band of the comparison. `# not_measured:` is not used: rows at
/// rest or with a saturated sensor have `moving` 0. Returns the names of the files.
/// @throws hal::SetupError if a file cannot be written.
std::vector<std::string> write_residuals(const model::effects::DriveModel& model,
                                         const identification::gap::MeasuredGap& data,
                                         const std::filesystem::path& directory);

/// The same of all joints of an arm: joint_1_position_rad and so on, in the rows of the comparison. The lag
/// of the torques is in the prediction.
std::vector<std::string> write_residuals(const std::string& robot, const control::ArmDescription& arm,
                                         const identification::robot_gap::MeasuredArm& data,
                                         const std::filesystem::path& directory);

}  // namespace analysis
