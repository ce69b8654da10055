/// @file
/// The model of the arm from which an excitation starts.
#pragma once
#include <filesystem>
#include <string>

#include "runtime/configuration/robot_file.h"

namespace youbot_bench {

/// The youBot's arm as control knows it without a robot file, with the columns of recordings of youbotd;
/// its URDF is control::youbot_urdf().
runtime::RobotFile described_arm();

/// A robot file of the youBot's arm, which may contain effects that control has no model of.
/// @throws runtime::ConfigError; std::invalid_argument naming `option` if it describes another arm.
runtime::RobotFile read_given_arm(const std::filesystem::path& path, const std::string& option);

}  // namespace youbot_bench
