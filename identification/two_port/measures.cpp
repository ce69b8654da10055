#include "identification/two_port/measures.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace identification::two_port {
namespace {

using Complex = std::complex<double>;
using Points = std::vector<HybridPoint>;

/// Mean of a function over an abscissa, by the trapezoidal rule.
double mean(const Points& points, const std::function<double(const HybridPoint&)>& abscissa,
            const std::function<double(const HybridPoint&)>& value) {
  double area = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i)
    area += 0.5 * (value(points[i]) + value(points[i - 1])) * (abscissa(points[i]) - abscissa(points[i - 1]));
  return area / (abscissa(points.back()) - abscissa(points.front()));
}

Tracking tracking(const Points& points, const std::function<Complex(const Eigen::Matrix2cd&)>& element) {
  Tracking result;
  double sum = 0.0;
  int count = 0;
  for (const HybridPoint& point : points) {
    if (point.frequency_Hz > 2.0 * points.front().frequency_Hz) break;
    sum += std::abs(element(point.H));
    ++count;
  }
  result.low_frequency_gain = sum / count;
  const double limit = result.low_frequency_gain / std::numbers::sqrt2;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double gain = std::abs(element(points[i].H));
    if (gain >= limit) continue;
    // Linear between the points in a log-log plot.
    const double before = std::abs(element(points[i - 1].H));
    const double share = std::log(before / limit) / std::log(before / gain);
    result.bandwidth_Hz =
        points[i - 1].frequency_Hz * std::pow(points[i].frequency_Hz / points[i - 1].frequency_Hz, share);
    break;
  }
  return result;
}

FeltEnvironment felt(const Points& points, const PortEnvironment& environment, double fidelity_band_Hz) {
  FeltEnvironment result{.name = environment.name};
  const auto Z_e = [&environment](const HybridPoint& point) {
    return environment.impedance_N_s_per_m(point.frequency_Hz);
  };
  result.transparency_error = mean(
      points, [](const HybridPoint& point) { return std::log(point.frequency_Hz); },
      [&](const HybridPoint& point) {
        return std::abs(std::log(transmitted_impedance(point.H, Z_e(point)) / Z_e(point)));
      });
  Points band = points;
  std::erase_if(band, [&](const HybridPoint& point) { return point.frequency_Hz > fidelity_band_Hz; });
  result.fidelity = band.size() < 2 ? std::numeric_limits<double>::quiet_NaN()
                                    : std::sqrt(mean(
                                          band, [](const HybridPoint& point) { return point.frequency_Hz; },
                                          [&](const HybridPoint& point) {
                                            return std::norm(transmitted_change(point.H, Z_e(point)));
                                          }));
  return result;
}

}  // namespace

Complex PortEnvironment::impedance_N_s_per_m(double frequency_Hz) const {
  const double w = 2 * std::numbers::pi * frequency_Hz;
  return {damping_N_s_per_m, mass_kg * w - stiffness_N_per_m / w};
}

std::vector<PortEnvironment> usual_environments() {
  return {{"soft", 200.0, 2.0}, {"medium", 1000.0, 5.0}, {"hard", 5000.0, 10.0}};
}

Complex transmitted_impedance(const Eigen::Matrix2cd& H, Complex Z_e) {
  return H(0, 0) - H(0, 1) * H(1, 0) * Z_e / (1.0 + H(1, 1) * Z_e);
}

Complex transmitted_change(const Eigen::Matrix2cd& H, Complex Z_e) {
  const Complex divisor = 1.0 + H(1, 1) * Z_e;
  return -H(0, 1) * H(1, 0) / (divisor * divisor);
}

Complex impedance_width(const Eigen::Matrix2cd& H) { return -H(0, 1) * H(1, 0) / H(1, 1); }

double llewellyn_stability(const Eigen::Matrix2cd& H) {
  const Complex product = H(0, 1) * H(1, 0);
  return (2.0 * H(0, 0).real() * H(1, 1).real() - product.real()) / std::abs(product);
}

bool unconditionally_stable(const Eigen::Matrix2cd& H) {
  const Complex product = H(0, 1) * H(1, 0);
  return H(0, 0).real() >= 0.0 && H(1, 1).real() >= 0.0 &&
         2.0 * H(0, 0).real() * H(1, 1).real() - product.real() >= std::abs(product);
}

TwoPortMeasures measure(const std::vector<HybridPoint>& measured,
                        const std::vector<PortEnvironment>& environments, double fidelity_band_Hz) {
  Points points = measured;
  std::erase_if(points, [](const HybridPoint& point) { return !point.ok; });
  if (points.size() < 3)
    throw std::invalid_argument("two-port: " + std::to_string(points.size()) +
                                " usable points, measures take three or more");
  TwoPortMeasures result;
  result.discarded = measured.size() - points.size();
  result.position = tracking(points, [](const Eigen::Matrix2cd& H) { return H(1, 0); });
  result.force = tracking(points, [](const Eigen::Matrix2cd& H) { return H(0, 1); });
  result.scaling_product = result.position.low_frequency_gain * result.force.low_frequency_gain;
  for (const PortEnvironment& environment : environments)
    result.environments.push_back(felt(points, environment, fidelity_band_Hz));
  std::size_t stable = 0;
  for (const HybridPoint& point : points) {
    if (unconditionally_stable(point.H))
      ++stable;
    else if (!result.unstable_from_Hz)
      result.unstable_from_Hz = point.frequency_Hz;
  }
  result.stable_share = static_cast<double>(stable) / static_cast<double>(points.size());
  return result;
}

}  // namespace identification::two_port
