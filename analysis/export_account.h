/// @file
/// What an export loses, and what that costs on recordings.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/export_parts.h"
#include "analysis/sliding_fit.h"
#include "identification/gap/measured_gap.h"

namespace analysis {

/// Of an effect that is not carried: what is not predicted without it, and with the whole model [N·m].
struct Cost {
  double without_Nm = 0;
  double whole_Nm = 0;
};
/// "coulomb: joint frictionloss", or what is lost and what that costs. `cost`: empty without recordings.
std::string account_line(const Carriage& carriage, const std::optional<Cost>& cost);
/// The last line: what is left, with the model and with what the target holds; empty without recordings.
std::string account_end(std::string_view target, const std::optional<Cost>& cost);

/// The gap of `model` with its sliding friction replaced by `sliding` [N·m].
double gap_with_sliding_Nm(const identification::gap::MeasuredGap& data,
                           const model::effects::DriveModel& carried, const SlidingFit& sliding);

/// A line for each effect, one for the fit of the sliding friction if it is not exact, and one with the gap
/// of the model and of what the target holds of it. `data`: null if there are no recordings.
std::vector<std::string> account_of(const model::effects::DriveModel& model, const Target& target,
                                    const SlidingFit& sliding, const identification::gap::MeasuredGap* data);

}  // namespace analysis
