/// @file
/// Exit codes of all commands.
#pragma once

namespace runtime {

inline constexpr int kExitOk = 0;
inline constexpr int kExitDisagreement = 1;  ///< done, but a result is not what it must be
inline constexpr int kExitUsage = 2;         ///< command line or configuration
inline constexpr int kExitSetup = 3;         ///< device or set-up
inline constexpr int kExitFault = 4;         ///< stopped by a fault
/// Ctrl-C before the work was done, as in shells (128 + SIGINT).
inline constexpr int kExitInterrupted = 130;

}  // namespace runtime
