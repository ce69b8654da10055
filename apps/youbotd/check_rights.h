/// @file
/// Checks the permissions of this process by trying.
#pragma once
#include <optional>
#include <string>

#include "apps/youbotd/finding.h"

namespace youbotd {

/// The command that gives this program, and its users, all permissions that it needs.
std::string how_to_give_rights();

/// Locks the present memory, and unlocks it again. `refused`: severity of a refusal.
Finding check_memory_lock(Finding::Mark refused);

/// Takes SCHED_FIFO in its own thread. `who`: "the cycle".
Finding check_priority(const std::string& who, int priority, Finding::Mark refused);

/// Pins its own thread to that core.
Finding check_core(int cpu, Finding::Mark refused);

}  // namespace youbotd
