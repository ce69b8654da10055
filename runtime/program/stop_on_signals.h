/// @file
#pragma once
#include <atomic>

namespace runtime {

/// Becomes true when the program is asked to end, after stop_on_signals().
inline std::atomic<bool> stop_requested{false};

/// From now on Ctrl-C, termination and the loss of the terminal request an orderly end instead of ending the
/// program, and a closed reader (SIGPIPE) does not end it.
void stop_on_signals();

}  // namespace runtime
