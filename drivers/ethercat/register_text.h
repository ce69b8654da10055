/// @file
/// A slave's register in words.
#pragma once
#include <cstdint>
#include <string>

namespace drivers::ethercat {

/// Setup: "0x0420 (process data watchdog)", of those that a master configures.
std::string register_text(std::uint16_t address);

}  // namespace drivers::ethercat
