/// @file
/// Settings that act during a teleoperation: those of control::TeleopTuning.
#pragma once
#include <span>
#include <string_view>

#include "operation/config.h"

namespace operation {

/// Their keys, as in the configuration file.
std::span<const std::string_view> tunable_keys() noexcept;

/// Copies the value of one of these keys, and nothing else. Another key copies nothing.
void copy_tunable(std::string_view key, const Config& from, Config& to) noexcept;

/// Rules between these settings and those of a run.
/// @throws std::invalid_argument naming the key that breaks one.
void require_consistent(const Config& config);

}  // namespace operation
