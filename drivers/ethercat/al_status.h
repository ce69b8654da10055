/// @file
/// AL states of a slave, and its reasons to refuse one (ETG.1000.6, table 9 and table 11).
#pragma once
#include <cstdint>

namespace drivers::ethercat {

enum class AlState : std::uint8_t { kNone = 0, kInit = 1, kPreOp = 2, kBoot = 3, kSafeOp = 4, kOp = 8 };

/// "INIT", "PRE-OP", ...
const char* to_string(AlState state) noexcept;
/// Text of an AL status code: 0x001E is "invalid input configuration".
const char* describe_al_status_code(std::uint16_t code) noexcept;

}  // namespace drivers::ethercat
