/// @file
#pragma once
#include "analysis/findings.h"
#include "report/report.h"

namespace analysis {

/// The HTML report: what was missing and how certain that is, where it is visible, measured against simulated
/// before and after, and what was tried without success.
report::Page gap_report(const Findings& findings);

}  // namespace analysis
