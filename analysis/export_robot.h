/// @file
/// `youbot-gap export` of a robot file: the arm with its corrections.
#pragma once
#include "analysis/export.h"

namespace analysis {

/// As export_model(), of a robot file. A base is refused.
void export_robot(const ExportOptions& options);

}  // namespace analysis
