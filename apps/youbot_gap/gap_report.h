/// @file
#pragma once
#include "apps/report/report.h"
#include "apps/youbot_gap/findings.h"

namespace youbot_gap {

/// The page for people: what was missing and how sure that is, where it shows, measured against simulated
/// before and after, and what was tried in vain.
report::Page gap_report(const Findings& findings);

}  // namespace youbot_gap
