/// @file
/// Measured drives in the project's formats: published data of each, and its recordings.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "identification/recording.h"
#include "model/effects/drive_model.h"

namespace real_recordings {

struct ConvertedRecording {
  std::string file;  ///< name, with .csv
  identification::Recording recording;
};

/// Joint side, SI. The model contains the prior knowledge of a laboratory: inertia, Coulomb and viscous
/// friction as published or from data sheets, and an attached weight.
struct ConvertedDrive {
  model::effects::DriveModel base;   ///< its name is that of the rig and of the directory
  std::vector<std::string> remarks;  ///< sources of its numbers; comments of the model file
  std::vector<ConvertedRecording> data;
  std::vector<ConvertedRecording> held_out{};  ///< empty: the analysis sets data aside
};

// One for each folder of tests/data; its README documents the mapping. `folder`: that folder.
// @throws std::runtime_error naming the file that cannot be used.

/// `drive`: 1 or 2.
ConvertedDrive screw_drive(const std::filesystem::path& folder, int drive);
/// `motor`: 1 to 3.
ConvertedDrive omni_wheel(const std::filesystem::path& folder, int motor);
ConvertedDrive outrunner(const std::filesystem::path& folder);
ConvertedDrive pendulum_servo(const std::filesystem::path& folder);
/// The same servo by its set-points, without a torque: the model has its law. `held_out_kp`: the gain, "100",
/// "200", "400" or "800", whose recordings are held out.
ConvertedDrive pendulum_loop(const std::filesystem::path& folder, const std::string& held_out_kp = "200");

/// All of the above; `data`: the folder that holds theirs.
std::vector<ConvertedDrive> converted_drives(const std::filesystem::path& data);

/// DIRECTORY/base.toml, DIRECTORY/data/*.csv and, where there are any, DIRECTORY/held_out/*.csv.
void write_drive(const ConvertedDrive& drive, const std::filesystem::path& directory);

}  // namespace real_recordings
