/// @file
/// The `[plausibility]` table of a configuration file: which checks of the sensors are off. And what is said
/// of those that do not run.
#pragma once
#include <string>
#include <vector>

#include "control/plausibility/checks.h"
#include "runtime/configuration/toml_reader.h"

namespace runtime {

/// Takes over what `table` holds: off = ["wheel_agreement"].
void read_plausibility(TomlTable table, control::ChecksOff& off);

/// The table as text from which read_plausibility() gets the same.
std::string plausibility_text(const control::ChecksOff& off);

/// Set-up: logs a warning for each check that is off. With each enable.
void warn_of(const control::ChecksOff& off);

/// A warning for each check that late answers keep, or kept, from judging.
std::vector<std::string> notes_on_silent(const control::ChecksOff& silent);

}  // namespace runtime
