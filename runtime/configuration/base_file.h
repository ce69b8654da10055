/// @file
/// Bases on wheels for youbot-gap as files: format youbot-robot-model/1 with a table [base].
#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "control/base_description.h"
#include "runtime/configuration/robot_file.h"

namespace runtime {

class TomlTable;

struct BaseFile {
  std::string name;
  control::BaseDescription base;
  double wheelbase_m = 0;  ///< mecanum, as written; turning_length_m counts where it differs from their mean
  double track_m = 0;
  double window_s = 0;  ///< over which displacements are compared; 0: from the data
  /// Which column of a recording is what. Values in the table's unit times the factor are SI.
  struct Columns {
    struct Wheel {
      std::string position;  ///< one of the two is empty
      std::string speed;
      double factor = 1;
      std::string load;    ///< empty: not measured
      std::string torque;  ///< of all wheels, or of none
      double torque_factor = 1;
    };
    std::string time;      ///< empty: t_s or time_s
    std::string run;       ///< empty: a recording is one run
    std::string steering;  ///< tricycle
    double steering_factor = 1;
    std::vector<Wheel> wheels;  ///< in the order of the base's
    std::string x;
    std::string y;
    std::string heading;
    double position_factor = 1;
    double heading_factor = 1;
    bool mirrored = false;  ///< y is negated after reading
  };
  Columns columns;
  /// Beginnings of the names of the recordings on each of the base's floors.
  std::vector<std::vector<std::string>> floor_recordings{};

  /// The floor with the longest beginning of this name; −1: none.
  int floor_of(std::string_view recording) const;
};

/// The key by which a robot file describes a base, not an arm; empty: it describes an arm.
std::optional<std::string_view> key_of_base(const TomlTable& root);
/// Whether a robot file describes a base, not an arm. @throws ConfigError if it cannot be read.
bool describes_base(const std::filesystem::path& path);

/// @throws ConfigError with all problems of the file.
BaseFile read_base_file(const std::filesystem::path& path);

/// Text from which read_base_file() restores every digit. Parts of remarks: "base", "steering", "tracking",
/// "floor" (its slope), names of wheels and floors.
std::string base_file_text(const BaseFile& file, std::span<const std::string> header,
                           std::span<const RobotRemark> remarks);

}  // namespace runtime
