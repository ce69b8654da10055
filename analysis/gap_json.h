/// @file
#pragma once
#include <string>

#include "analysis/findings.h"

namespace analysis {

/// The text of gap.json, format youbot-gap/1. A parameter without an interval has the effect's bounds for
/// one, and the reason beside it; an effect that could not be tried is not among the rejected.
/// @throws std::logic_error naming what is not a finite number otherwise.
std::string gap_json(const Findings& findings);

}  // namespace analysis
