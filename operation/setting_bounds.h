/// @file
/// Limits on settings over the control socket: docs/safety.md, "What `set` may change".
#pragma once
#include <filesystem>

#include "operation/config.h"

namespace operation {

/// A setting may make the machine weaker, slower and sooner to stop than `from_file`, not the reverse.
/// @throws runtime::ConfigError naming each key of `set` that violates this, and what `file` allows.
void require_no_weaker(const Config& set, const Config& from_file, const std::filesystem::path& file);

}  // namespace operation
