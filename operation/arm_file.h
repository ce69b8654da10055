/// @file
/// The robot file of an arm that a configuration names.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "runtime/configuration/arm_model.h"
#include "runtime/configuration/toml_reader.h"

namespace operation {

/// In the folder of ArmFile::text: control::youbot_urdf().
inline constexpr std::string_view kArmFileUrdf = "youbot.urdf";

struct ArmFile {
  std::string name;            ///< as written in the configuration
  std::filesystem::path path;  ///< from the working directory
  /// A robot file of the same model, with every link, on kArmFileUrdf: a copy of it needs nothing else.
  std::string text;
  runtime::ArmModel model;
};

/// The robot file that `key` names, relative to `folder`; empty if the key is missing or refused, with the
/// file's own problems in the message. `set` may not name one.
std::optional<ArmFile> read_arm_file(runtime::TomlTable& table, std::string_view key,
                                     const std::filesystem::path& folder);

}  // namespace operation
