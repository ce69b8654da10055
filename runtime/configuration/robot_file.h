/// @file
/// Robots for youbot-gap as files: format youbot-robot-model/1, an arm by its URDF and a table of its drives.
#pragma once
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "control/arm_description.h"

namespace runtime {

struct RobotFile {
  std::string name;
  std::filesystem::path urdf;  ///< from the working directory
  std::string base;            ///< links between which the arm is
  std::string tip;
  control::ArmDescription arm;
  double band_Hz = 10;  ///< up to which torques are compared
  std::vector<double> ripples_per_rev{};
  /// Which column of a recording is what. Values in the table's unit times the factor are SI, joint side.
  struct Columns {
    std::string time;  ///< empty: t_s or time_s
    std::vector<std::string> position;
    std::vector<std::string> torque;
    std::vector<double> position_factor;
    std::vector<double> torque_factor;
  };
  Columns columns;
  bool links_changed = false;  ///< an inertia is not the URDF's
};

/// Whether the file's `format` is that of robots, arms or bases. @throws ConfigError if it cannot be read.
bool is_robot_file(const std::filesystem::path& path);

/// A number of a [[drive]]. Left out, it is that of a default ArmDrive.
struct DriveKey {
  std::string_view key;
  double control::ArmDrive::*member;
  double lower;
};
/// All of them, in the order in which they are written.
std::span<const DriveKey> drive_keys() noexcept;

/// Something in the file that its reader cannot use.
struct RobotMisfit {
  std::string table;  ///< "drive", "link", "payload"; empty: the keys before all tables
  std::string part;   ///< joint of the drive, or name of the link
  std::string key;
  std::string complaint;  ///< follows the key in the message
};
using RobotCheck = std::function<std::vector<RobotMisfit>(const RobotFile&)>;

/// `check`: called with a file without problems; what it returns are problems, too.
/// @throws ConfigError with all problems of the file and of the URDF that it names, or for a base's file.
RobotFile read_robot_file(const std::filesystem::path& path, const RobotCheck& check = {});

/// A comment on one part of the file.
struct RobotRemark {
  std::string part;  ///< joint or link; "tip" or "base"
  std::string text;  ///< a line
};

/// Text from which read_robot_file() restores every digit. `urdf`: as the file names it. `given`: links are
/// written where they differ from it.
std::string robot_file_text(const RobotFile& robot, const std::filesystem::path& urdf,
                            const control::ArmDescription& given, std::span<const std::string> header,
                            std::span<const RobotRemark> remarks);

}  // namespace runtime
