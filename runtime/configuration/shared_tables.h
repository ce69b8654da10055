/// @file
/// One configuration file for all programs on a robot: each reads its own tables and ignores the others.
#pragma once
#include <algorithm>
#include <array>
#include <initializer_list>
#include <string_view>

#include "runtime/configuration/toml_reader.h"

namespace runtime {

/// Keys and tables at the root of such a file, of all programs.
inline constexpr auto kSharedTables = std::to_array<std::string_view>(
    {"robot", "loop", "ethercat", "can", "haptic", "geometry", "controller", "limits", "workspace",
     "compensation", "path", "plausibility", "simulation", "teleoperation", "scene"});

/// Ignores all of them except the caller's `own`.
inline void leave_to_others(TomlTable& root, std::initializer_list<std::string_view> own) {
  for (const std::string_view table : kSharedTables)
    if (std::find(own.begin(), own.end(), table) == own.end()) root.ignore(table);
}

}  // namespace runtime
