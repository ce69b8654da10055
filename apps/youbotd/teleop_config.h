/// @file
/// What the configuration says about teleoperation, beside what every run of the daemon is told.
#pragma once
#include "apps/common/toml_reader.h"
#include "control/teleoperation.h"

namespace youbotd {

/// [teleoperation] and its tables; apps/youbotd/teleop.toml shows every key.
void read_teleoperation(apps::TomlTable table, control::Teleoperation::Config& control);

}  // namespace youbotd
