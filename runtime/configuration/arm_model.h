/// @file
/// The model of the youBot's arm from a robot file, such as `youbot-gap robot` delivers.
#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "control/robot_model.h"
#include "control/whole_body_controller.h"
#include "runtime/configuration/robot_file.h"

namespace runtime {

/// SI, joint side, signs and frames of control/robot_model.h.
struct ArmModel {
  control::ModelChanges changes;  ///< links of the arm and payload
  control::ArmFriction friction;
  std::array<double, control::kArmJoints> rotor_inertia_kg_m2{};  ///< behind the gears
  /// A line for each factor that scaled a recording before its torques were identified.
  std::vector<std::string> scaled_columns;
};

struct ArmModelFile {
  RobotFile robot;
  ArmModel model;
};

inline constexpr double kMaxPayload_kg = 2;
/// N·m, and N·m·s/rad.
inline constexpr double kMaxJointFriction = 10;

/// The file's geometry must be that of control/youbot.urdf, because all else here relies on that. Columns,
/// gear ratios and the band are about recordings and make no difference.
/// @throws ConfigError with all problems, each with file, line and key: also for each effect in the file that
/// control has no model of, because half of a model compensates worse than none, and for each value that is
/// not near that of a youBot.
ArmModelFile read_arm_model(const std::filesystem::path& path);

/// What the model changes, for people: what differs of each link, payload, friction, rotors, scaled columns.
std::vector<std::string> arm_model_lines(const ArmModel& model);

}  // namespace runtime
