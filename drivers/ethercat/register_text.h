/// @file
/// Name of a slave register.
#pragma once
#include <cstdint>
#include <string>

namespace drivers::ethercat {

/// Setup: "0x0420 (process data watchdog)", for registers that a master configures.
std::string register_text(std::uint16_t address);

}  // namespace drivers::ethercat
