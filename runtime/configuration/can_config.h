/// @file
/// The `[can]` table of a configuration file: the module on a bench rig, can:IFACE.
#pragma once
#include <string>

#include "hal/can_robot.h"
#include "runtime/configuration/toml_reader.h"

namespace runtime {

/// Applies the content of `table`. apps/youbotd/demo.toml shows every key.
void read_can(TomlTable& table, hal::CanOptions& options);

/// The options as text from which read_can() restores them.
std::string can_text(const hal::CanOptions& options);

}  // namespace runtime
