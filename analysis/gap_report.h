/// @file
#pragma once
#include "analysis/findings.h"
#include "report/report.h"

namespace analysis {

/// The page for people: what was missing and how sure that is, where it shows, measured against simulated
/// before and after, and what was tried in vain.
report::Page gap_report(const Findings& findings);

}  // namespace analysis
