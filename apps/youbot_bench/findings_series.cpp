#include "apps/youbot_bench/findings_series.h"

#include <algorithm>
#include <cmath>

namespace youbot_bench {

std::vector<double> result(const MeasuredJoint& joint, std::string_view column) {
  if (joint.results.rows() == 0) return {};
  const auto values = joint.results.column(column);
  return {values.begin(), values.end()};
}

std::vector<double> chosen(const std::vector<double>& values, const std::vector<double>& key, double value) {
  std::vector<double> those;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (key[i] == value) those.push_back(values[i]);
  return those;
}

std::vector<double> magnitudes(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  return values;
}

std::vector<std::string> names(const MeasuredExperiment& measured) {
  std::vector<std::string> result;
  for (const MeasuredJoint& joint : measured.joints) result.push_back(joint.name);
  return result;
}

report::Series points(const std::string& name, const std::vector<double>& x, const std::vector<double>& y,
                      const std::vector<double>& half_interval, unsigned look) {
  report::Series series{
      .name = name, .x = x, .y = y, .style = report::Style::kPoints, .lower = y, .upper = y, .look = look};
  for (std::size_t i = 0; i < half_interval.size(); ++i) {
    series.lower[i] -= half_interval[i];
    series.upper[i] += half_interval[i];
  }
  return series;
}

void append(report::Series& series, const std::vector<double>& x, const std::vector<double>& y) {
  if (x.empty()) return;
  if (!series.x.empty()) {
    series.x.push_back(kUnknown);
    series.y.push_back(kUnknown);
  }
  series.x.insert(series.x.end(), x.begin(), x.end());
  series.y.insert(series.y.end(), y.begin(), y.end());
}

}  // namespace youbot_bench
