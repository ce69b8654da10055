/// @file
/// Effects that a set of recordings could not have shown.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "identification/gap/signals.h"

namespace identification::gap {

/// A sentence for each group of effects that the search cannot have found in this data, whether it is there
/// or not, with the recording that would show it. Where `rests` is false, nothing rested under a changing
/// torque.
std::vector<std::string> blind_spots(std::span<const Signals> signals, bool rests);

}  // namespace identification::gap
