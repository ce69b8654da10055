/// @file
/// The model of the youBot's arm from a robot file, such as `youbot-gap robot` delivers.
#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "control/robot_model.h"
#include "control/whole_body_controller.h"

namespace runtime {

/// SI, joint side, signs and frames of control/robot_model.h.
struct ArmModel {
  control::ModelChanges changes;  ///< links of the arm and payload
  control::ArmFriction friction;
  /// Behind the gears; empty: not in the file.
  std::array<std::optional<double>, control::kArmJoints> rotor_inertia_kg_m2{};
};

/// The file's geometry must be that of control/youbot.urdf, because all else here relies on that. Columns,
/// factors, gear ratios and the band are about recordings and make no difference.
/// @throws ConfigError with all problems, each with file, line and key: also for each effect in the file that
/// our model has no place for, because half of a model compensates worse than none.
ArmModel read_arm_model(const std::filesystem::path& path);

/// What the model changes, a line for each link that differs, the payload and the friction, for people.
std::vector<std::string> arm_model_lines(const ArmModel& model);

}  // namespace runtime
