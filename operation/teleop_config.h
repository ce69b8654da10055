/// @file
/// Configuration of teleoperation, in addition to that of every run.
#pragma once
#include "control/teleoperation.h"
#include "runtime/configuration/toml_reader.h"

namespace operation {

/// [teleoperation] and its tables; apps/youbotd/teleop.toml shows every key.
void read_teleoperation(runtime::TomlTable table, control::Teleoperation::Config& control);

}  // namespace operation
