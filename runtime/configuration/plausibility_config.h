/// @file
/// The `[plausibility]` table of a configuration file: which checks of the sensors are off; and the messages
/// about checks that do not run.
#pragma once
#include <string>
#include <vector>

#include "control/plausibility/checks.h"
#include "runtime/configuration/toml_reader.h"

namespace runtime {

/// Applies the content of `table`: off = ["wheel_agreement"].
void read_plausibility(TomlTable table, control::ChecksOff& off);

/// The table as text from which read_plausibility() restores it.
std::string plausibility_text(const control::ChecksOff& off);

/// Set-up, at each enable: logs a warning for each check that is off.
void warn_of(const control::ChecksOff& off);

/// A warning for each check that cannot judge, or could not, because answers are late.
std::vector<std::string> notes_on_silent(const control::ChecksOff& silent);

}  // namespace runtime
