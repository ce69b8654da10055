/// @file
/// What every command tells its caller.
#pragma once

namespace runtime {

inline constexpr int kExitOk = 0;
inline constexpr int kExitUsage = 2;  ///< command line or configuration
inline constexpr int kExitSetup = 3;  ///< device or set-up
inline constexpr int kExitFault = 4;  ///< stopped by a fault

}  // namespace runtime
