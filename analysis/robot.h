/// @file
/// `youbot-gap robot`: finds which part of a robot's model is wrong, and by which effect.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
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

/// Of a base: the path of a whole run, predicted from its first pose.
struct PathGap {
  std::string recording;
  double run = 0;  ///< of the column; 0 without
  bool held_out = false;
  double length_m = 0;  ///< of the measured path
  /// Predicted minus measured.
  struct Error {
    double rms_m = 0;  ///< over the run
    double end_m = 0;
    double end_heading_rad = 0;
  };
  Error before{};
  Error after{};
};

struct RobotFindings {
  std::string name;  ///< of the robot; may be empty
  std::string base_path;
  std::vector<std::string> data;  ///< names of the searched recordings
  std::uint64_t seed = 1;
  identification::robot_gap::RobotResult result;
  std::vector<PathGap> paths{};  ///< of a base
  std::string channel_word;      ///< what a channel is: "joint"
  std::string metric;            ///< "rms torque residual over all joints, held-out"
  std::string comparison;        ///< what is compared and what the noise floor is: sentences for the report
};

/// A robot with its recordings, ready for the search.
struct OpenedRobot {
  std::unique_ptr<identification::robot_gap::Subject> subject;
  RobotFindings findings;             ///< without the result
  std::vector<std::string> warnings;  ///< of the recordings
  /// Adds to the findings of the search what is of this kind of robot; may be empty.
  std::function<void(RobotFindings& findings)> complete{};
  /// Text of the delivered model, for a file in `out`.
  std::function<std::string(const RobotFindings& findings, const std::filesystem::path& out)> model_text;
};
/// An arm, its joints' positions and torques as the robot file names their columns.
/// @throws runtime::ConfigError with the problems of the robot file or of every recording;
/// std::invalid_argument if the data cannot answer the question.
OpenedRobot open_arm(const RobotGapOptions& options);
/// A base, its wheels and its measured pose; otherwise the same.
OpenedRobot open_base(const RobotGapOptions& options);

/// Texts of two of the three files, and of the terminal.
std::string robot_gap_json(const RobotFindings& findings);
std::string robot_report_html(const RobotFindings& findings);
std::string robot_summary_text(const RobotFindings& findings);
/// First comments of a delivered model, and lines above its parts.
std::vector<std::string> robot_header(const RobotFindings& findings);
std::vector<runtime::RobotRemark> robot_remarks(const RobotFindings& findings);

/// "coulomb of joint2 or of joint1": with the rivals that the data cannot distinguish.
std::string part_with_rivals(const identification::robot_gap::FoundPart& found);
std::string part_words(const identification::robot_gap::NamedEffect& name);

/// Writes `out`/model.toml, report.html and gap.json, each complete or missing, and prints the result.
/// @throws runtime::ConfigError or std::invalid_argument if model, recordings or directory cannot be used, or
/// the data cannot answer the question; hal::SetupError if a file cannot be written.
void explain_robot(const RobotGapOptions& options);

}  // namespace analysis
