/// @file
#pragma once
#include <string>

#include "analysis/findings.h"

namespace analysis {

/// The text of model.toml: each added effect under its evidence, each parameter with its 95 % interval, each
/// one of the given model with the value it had.
std::string improved_model_text(const Findings& findings);

}  // namespace analysis
