/// @file
/// How a real-time test reports that the machine prevented a result.
#pragma once

namespace support {

/// Exit code for while_machine_keeps_time: the only error was repeated lateness.
inline constexpr int kHeldUp = 75;

}  // namespace support
