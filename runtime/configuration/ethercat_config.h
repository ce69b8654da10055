/// @file
/// The `[ethercat]` table of a configuration file, which every program on a bus reads alike.
#pragma once
#include <chrono>
#include <string>

#include "hal/ethercat_robot.h"
#include "runtime/configuration/toml_reader.h"

namespace runtime {

/// How long `home_arms` may take. A joint's whole travel takes a minute; found in its middle and blocked, it
/// goes back and forth.
inline constexpr std::chrono::seconds kHomingTimeout{150};

/// Takes over what `table` holds, for a cycle of `period`. apps/youbotd/demo.toml shows every key.
void read_ethercat(TomlTable& table, std::chrono::nanoseconds period, hal::EthercatOptions& options);

/// The table, `[[ethercat.parameter]]` included, as text from which read_ethercat() gets the same options.
std::string ethercat_text(const hal::EthercatOptions& options);

/// "base+arm" → the kind. @throws std::invalid_argument listing those there are.
hal::YoubotKind ethercat_kind(const std::string& name);

}  // namespace runtime
