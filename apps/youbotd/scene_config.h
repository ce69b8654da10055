/// @file
/// What the configuration says about what a simulated robot can touch.
#pragma once
#include "apps/common/toml_reader.h"
#include "sim/environment.h"

namespace youbotd {

/// [scene], with walls, tables and a free box; apps/youbotd/teleop.toml has one.
void read_scene(apps::TomlTable table, sim::EnvironmentParameters& scene);

}  // namespace youbotd
