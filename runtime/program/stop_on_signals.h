/// @file
#pragma once
#include <atomic>

namespace runtime {

/// Becomes true when the program is asked to end, after stop_on_signals().
inline std::atomic<bool> stop_requested{false};

/// From now on Ctrl-C, termination and a terminal that goes away ask for an orderly end instead of ending the
/// program, and a reader that is gone (SIGPIPE) is no reason to end at all.
void stop_on_signals();

}  // namespace runtime
