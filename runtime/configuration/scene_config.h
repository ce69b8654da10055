/// @file
/// Configuration of the objects that a simulated robot can touch.
#pragma once
#include <filesystem>

#include "runtime/configuration/toml_reader.h"
#include "sim/environment.h"

namespace runtime {

/// [scene], with walls, tables and a free box; apps/youbotd/teleop.toml has one.
void read_scene(TomlTable table, sim::EnvironmentParameters& scene);

/// The same from a whole file, whose other tables belong to other programs. @throws ConfigError
sim::EnvironmentParameters load_scene(const std::filesystem::path& path);

}  // namespace runtime
