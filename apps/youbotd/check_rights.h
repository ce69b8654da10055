/// @file
/// What this process may do, found out by doing it.
#pragma once
#include <optional>
#include <string>

#include "apps/youbotd/finding.h"

namespace youbotd {

/// The command that gives this program, and whoever may run it, all that it needs.
std::string how_to_give_rights();

/// Locks the memory that there is, and lets it go again. `refused`: how bad it is when it may not.
Finding check_memory_lock(Finding::Mark refused);

/// Takes SCHED_FIFO in a thread of its own. `who`: "the cycle".
Finding check_priority(const std::string& who, int priority, Finding::Mark refused);

/// Puts a thread of its own on that core.
Finding check_core(int cpu, Finding::Mark refused);

}  // namespace youbotd
