/// @file
/// Plots about a gap. Before and after mean the given model and the new one; each has the same style in all
/// plots.
#pragma once
#include <span>
#include <vector>

#include "identification/gap/gap.h"
#include "report/report.h"

namespace analysis {

/// The gap after each step, above the noise floor.
report::Plot steps_plot(const std::vector<double>& gap_Nm, double noise_floor_Nm);
/// Without series if there is no curve.
report::Plot friction_plot(const identification::gap::FrictionCurve& curve);
std::vector<report::Plot> residual_plots(const identification::gap::Result& result);
std::vector<report::Plot> trace_plots(const identification::gap::Result& result);

/// The table of each term.
std::vector<report::Plot> term_plots(std::span<const model::effects::Empirical::Term> terms);

}  // namespace analysis
