/// @file
/// The step of a signal that is quantised.
#pragma once
#include <optional>
#include <span>

namespace identification::gap {

/// Nothing if the signal is not quantised, or if too few small changes show it.
std::optional<double> quantum_of(std::span<const double> signal);

}  // namespace identification::gap
