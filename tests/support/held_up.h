/// @file
/// How a test in real time says that the machine kept it from its result.
#pragma once

namespace support {

/// Exit code for while_machine_keeps_time: nothing was wrong but that something came too late again and
/// again.
inline constexpr int kHeldUp = 75;

}  // namespace support
