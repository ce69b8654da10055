/// @file
/// Configuration of teleoperation, in addition to that of every run.
#pragma once
#include <filesystem>
#include <optional>

#include "control/teleoperation.h"
#include "operation/arm_file.h"
#include "runtime/configuration/toml_reader.h"

namespace operation {

/// [teleoperation] and its tables; apps/youbotd/teleop.toml shows every key. `folder`: that of the
/// configuration. Returns the robot file of the arm, if there is one; it is in `control`, too.
std::optional<ArmFile> read_teleoperation(runtime::TomlTable table, const std::filesystem::path& folder,
                                          control::Teleoperation::Config& control);

}  // namespace operation
