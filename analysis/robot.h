/// @file
/// `youbot-gap robot`: finds which part of an arm's model is wrong, and by which effect.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "identification/robot_gap/robot_gap.h"
#include "runtime/configuration/robot_file.h"

namespace analysis {

struct RobotGapOptions {
  std::filesystem::path model{};
  std::vector<std::filesystem::path> data{};      ///< recordings, or directories of them
  std::vector<std::filesystem::path> held_out{};  ///< the same; may be empty
  std::filesystem::path out{};
  std::uint64_t seed = 1;
  bool quiet = false;
};

struct RobotFindings {
  runtime::RobotFile base;  ///< as given
  std::string base_path;
  std::vector<std::string> data;  ///< names of the searched recordings
  std::uint64_t seed = 1;
  identification::robot_gap::RobotResult result;
};

/// Reads the recordings of all joints, as the robot file names their columns. `warnings` of the reader.
/// @throws runtime::ConfigError with the problems of every recording.
struct RobotRecordings {
  std::vector<identification::robot_gap::ArmRecording> data;
  std::vector<identification::robot_gap::ArmRecording> held_out;
  std::vector<std::string> warnings;
};
RobotRecordings read_robot_recordings(const runtime::RobotFile& robot, const RobotGapOptions& options);

/// Texts of the three files, and of the terminal.
std::string robot_model_text(const RobotFindings& findings, const std::filesystem::path& out);
std::string robot_gap_json(const RobotFindings& findings);
std::string robot_report_html(const RobotFindings& findings);
std::string robot_summary_text(const RobotFindings& findings);

/// "coulomb of joint2 or of joint1": with the rivals that the data cannot distinguish.
std::string part_with_rivals(const identification::robot_gap::FoundPart& found);
std::string part_words(const identification::robot_gap::NamedEffect& name);

/// Writes `out`/model.toml, report.html and gap.json, each complete or missing, and prints the result.
/// @throws runtime::ConfigError or std::invalid_argument if model, recordings or directory cannot be used, or
/// the data cannot answer the question; hal::SetupError if a file cannot be written.
void explain_robot(const RobotGapOptions& options);

}  // namespace analysis
