/// @file
#pragma once
#include <string>

#include "analysis/findings.h"

namespace analysis {

/// The text of model.toml: each added effect with its evidence, each parameter with its 95 % interval, each
/// parameter of the given model with its original value.
std::string improved_model_text(const Findings& findings);

/// The same with the torque without a physical name, which the findings offer.
std::string unnamed_model_text(const Findings& findings);

}  // namespace analysis
