/// @file
/// The `[ethercat]` table of a configuration file, common to all programs on a bus.
#pragma once
#include <chrono>
#include <string>

#include "hal/ethercat_robot.h"
#include "runtime/configuration/toml_reader.h"

namespace runtime {

/// Time-out of `home_arms`. A joint's whole travel takes a minute; a joint that is blocked in the middle goes
/// back and forth.
inline constexpr std::chrono::seconds kHomingTimeout{150};

/// Applies the content of `table`, for a cycle of `period`. apps/youbotd/demo.toml shows every key.
void read_ethercat(TomlTable& table, std::chrono::nanoseconds period, hal::EthercatOptions& options);

/// The table, `[[ethercat.parameter]]` included, as text from which read_ethercat() restores the options.
std::string ethercat_text(const hal::EthercatOptions& options);

/// "base+arm" → the kind. @throws std::invalid_argument listing the known names.
hal::YoubotKind ethercat_kind(const std::string& name);

}  // namespace runtime
