/// @file
#pragma once
#include <string>

#include "analysis/findings.h"

namespace analysis {

/// Final output on the terminal: verdict, gap, a line for each effect, what is left and what to do next.
std::string summary_text(const Findings& findings);

}  // namespace analysis
