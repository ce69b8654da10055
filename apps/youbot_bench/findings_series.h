/// @file
/// Series and columns of results, common to the findings of all experiments.
#pragma once
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "apps/youbot_bench/experiment_data.h"
#include "report/report.h"

namespace youbot_bench {

/// Style of series without a joint: black on white, white on black.
inline constexpr unsigned kInk = 5;
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// One value for each finished measurement; empty if there are none.
std::vector<double> result(const MeasuredJoint& joint, std::string_view column);
/// The `values` for which `key` has the given value.
std::vector<double> chosen(const std::vector<double>& values, const std::vector<double>& key, double value);
std::vector<double> magnitudes(std::vector<double> values);
std::vector<std::string> names(const MeasuredExperiment& measured);

/// Markers with bars of `half_interval` to both sides; without bars where that is NaN.
report::Series points(const std::string& name, const std::vector<double>& x, const std::vector<double>& y,
                      const std::vector<double>& half_interval, unsigned look);
/// Appends with a gap in between.
void append(report::Series& series, const std::vector<double>& x, const std::vector<double>& y);

}  // namespace youbot_bench
