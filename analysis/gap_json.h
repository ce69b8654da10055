/// @file
#pragma once
#include <string>

#include "analysis/findings.h"

namespace analysis {

/// The text of gap.json, format youbot-gap/1. A parameter without an interval has the effect's bounds
/// instead, with the reason; an effect that could not be tried is not in the rejected list.
/// @throws std::logic_error naming any other value that is not finite.
std::string gap_json(const Findings& findings);

}  // namespace analysis
