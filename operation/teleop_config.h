/// @file
/// Configuration of teleoperation, in addition to that of every run.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "control/teleoperation.h"
#include "runtime/configuration/arm_model.h"
#include "runtime/configuration/toml_reader.h"

namespace operation {

/// In the folder of ArmFile::text: control::youbot_urdf().
inline constexpr std::string_view kArmFileUrdf = "youbot.urdf";

/// A robot file that the configuration names.
struct ArmFile {
  std::string name;            ///< as written there
  std::filesystem::path path;  ///< from the working directory
  /// A robot file of the same model, with every link, on kArmFileUrdf: a copy of it needs nothing else.
  std::string text;
  runtime::ArmModel model;
};

/// The robot file that `key` names, relative to `folder`; empty if the key is missing or refused, with the
/// file's own problems in the message. `set` may not name one.
std::optional<ArmFile> read_arm_file(runtime::TomlTable& table, std::string_view key,
                                     const std::filesystem::path& folder);

/// [teleoperation] and its tables; apps/youbotd/teleop.toml shows every key. `folder`: that of the
/// configuration. Returns the robot file of the arm, if there is one; it is in `control`, too.
std::optional<ArmFile> read_teleoperation(runtime::TomlTable table, const std::filesystem::path& folder,
                                          control::Teleoperation::Config& control);

}  // namespace operation
