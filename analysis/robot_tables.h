/// @file
/// Recordings of a robot, tables whose columns its robot file names.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "analysis/robot.h"
#include "identification/robot_gap/arm_motion.h"
#include "runtime/configuration/robot_file.h"
#include "runtime/recording/column_map.h"
#include "runtime/recording/recording_reader.h"

namespace analysis {

struct RobotTable {
  std::string name;  ///< of the file, as short as distinguishes it
  std::filesystem::path path;
  bool is_searched = true;
  identification::Recording recording;
};

/// Calls `take` with each table; its ConfigErrors are collected with those of the reader. `map`: without the
/// time, which is in `time_column`; empty: in t_s or time_s. Returns the reader's warnings.
/// @throws runtime::ConfigError with the problems of every recording.
std::vector<std::string> read_robot_tables(const RobotGapOptions& options, const runtime::ColumnMap& map,
                                           const std::string& time_column,
                                           const std::function<void(const RobotTable& table)>& take);

/// Parts without pauses, and the files that they are from.
struct ArmRecordings {
  std::vector<std::string> data_files;
  std::vector<std::string> held_out_files;
  std::vector<identification::robot_gap::ArmRecording> data;
  std::vector<identification::robot_gap::ArmRecording> held_out;
  std::vector<std::string> warnings;
};
/// Of an arm. @throws as read_robot_tables().
ArmRecordings read_arm_recordings(const runtime::RobotFile& robot, const RobotGapOptions& options);

}  // namespace analysis
