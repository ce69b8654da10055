#include "identification/two_port/hybrid_matrix.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>

namespace identification::two_port {
namespace {

using Complex = std::complex<double>;

constexpr std::size_t kHandForce = 0, kMasterVelocity = 1, kEnvironmentForce = 2, kSlaveVelocity = 3;

std::array<const std::vector<double>*, kChannels> channels_of(const PortRecord& record) {
  return {&record.hand_force_N, &record.master_velocity_m_per_s, &record.environment_force_N,
          &record.slave_velocity_m_per_s};
}

/// One line of the discrete Fourier transform of one period.
class Line {
 public:
  Line(std::size_t harmonic, std::size_t samples) : wave_(samples) {
    std::size_t at = 0;
    for (Complex& value : wave_) {
      const double angle_rad = 2 * std::numbers::pi * static_cast<double>(at) / static_cast<double>(samples);
      value = {std::cos(angle_rad), -std::sin(angle_rad)};
      at = (at + harmonic) % samples;
    }
  }
  Complex of(std::span<const double> period) const {
    Complex sum = 0.0;
    for (std::size_t n = 0; n < wave_.size(); ++n) sum += wave_[n] * period[n];
    return sum * (2.0 / static_cast<double>(wave_.size()));
  }

 private:
  std::vector<Complex> wave_;
};

/// Spectra of one experiment at one frequency, summed over its periods.
struct Spectra {
  int periods = 0;
  double excitation = 0.0;                 // Σ|R|²
  std::array<Complex, kChannels> cross{};  // Σ Y·R*
  std::array<double, kChannels> power{};   // Σ|Y|²

  Complex transfer(std::size_t channel) const { return cross[channel] / excitation; }
  /// Residual power of the transfer, per degree of freedom.
  double variance(std::size_t channel) const {
    const double left = std::max(0.0, power[channel] - std::norm(cross[channel]) / excitation);
    return left / ((periods - 1) * excitation);
  }
  double coherence(std::size_t channel) const {
    return std::norm(cross[channel]) / (power[channel] * excitation);
  }
};

Spectra spectra(const PortExperiment& experiment, const Line& line, std::size_t samples) {
  Spectra sum;
  for (const PortRecord& record : experiment.records) {
    const auto channels = channels_of(record);
    for (std::size_t begin = 0; begin < record.excitation_N.size(); begin += samples) {
      const auto period = [&](const std::vector<double>& signal) {
        return line.of(std::span(signal).subspan(begin, samples));
      };
      const Complex excitation = period(record.excitation_N);
      sum.excitation += std::norm(excitation);
      ++sum.periods;
      for (std::size_t i = 0; i < kChannels; ++i) {
        const Complex value = period(*channels[i]);
        sum.cross[i] += value * std::conj(excitation);
        sum.power[i] += std::norm(value);
      }
    }
  }
  return sum;
}

void check(const std::vector<PortExperiment>& experiments, std::size_t samples) {
  if (experiments.size() < 2)
    throw std::invalid_argument("two-port: one environment does not determine four unknowns; two are needed");
  if (samples == 0) throw std::invalid_argument("two-port: a period has no samples");
  for (const PortExperiment& experiment : experiments) {
    std::size_t periods = 0;
    for (std::size_t i = 0; i < experiment.records.size(); ++i) {
      const PortRecord& record = experiment.records[i];
      const std::size_t size = record.excitation_N.size();
      const std::string who =
          "two-port: experiment '" + experiment.environment + "', record " + std::to_string(i + 1);
      if (size == 0 || size % samples != 0)
        throw std::invalid_argument(who + " has " + std::to_string(size) +
                                    " samples, must be whole periods of " + std::to_string(samples));
      for (const std::vector<double>* channel : channels_of(record))
        if (channel->size() != size) throw std::invalid_argument(who + " has signals of different lengths");
      periods += size / samples;
    }
    if (periods < 2)
      throw std::invalid_argument("two-port: experiment '" + experiment.environment + "' has " +
                                  std::to_string(periods) + " periods, coherence takes two or more");
  }
}

HybridPoint solve(const std::vector<Spectra>& experiments, const EstimateLimits& limits) {
  HybridPoint point;
  point.coherence.fill(1.0);
  for (std::size_t channel = 0; channel < kChannels; ++channel) {
    double loudest = 0.0;
    for (const Spectra& each : experiments)
      loudest = std::max(loudest, each.power[channel] / each.excitation);
    for (const Spectra& each : experiments)
      if (each.power[channel] / each.excitation > limits.silent_share * loudest)
        point.coherence[channel] = std::min(point.coherence[channel], each.coherence(channel));
  }

  // X·Hᵀ = Y, a row per experiment.
  const auto rows = static_cast<Eigen::Index>(experiments.size());
  Eigen::MatrixX2cd X(rows, 2);
  Eigen::MatrixX2cd Y(rows, 2);
  Eigen::MatrixX2d X_variance(rows, 2);
  Eigen::MatrixX2d Y_variance(rows, 2);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const Spectra& each = experiments[static_cast<std::size_t>(row)];
    X.row(row) << each.transfer(kMasterVelocity), each.transfer(kEnvironmentForce);
    Y.row(row) << each.transfer(kHandForce), -each.transfer(kSlaveVelocity);
    X_variance.row(row) << each.variance(kMasterVelocity), each.variance(kEnvironmentForce);
    Y_variance.row(row) << each.variance(kHandForce), each.variance(kSlaveVelocity);
  }
  const Eigen::Vector2d scale = X.colwise().norm();
  if (!scale.allFinite() || !Y.allFinite() || scale.minCoeff() <= 0.0) {
    point.condition = std::numeric_limits<double>::infinity();
    return point;
  }
  // For two columns of unit length, the scalar product decides: their singular values are √(1 ± |product|).
  const Eigen::MatrixX2cd scaled = X * scale.cwiseInverse().asDiagonal();
  const Complex product = scaled.col(0).dot(scaled.col(1));
  const double independent = 1.0 - std::norm(product);
  if (independent <= std::numeric_limits<double>::epsilon()) {
    point.condition = std::numeric_limits<double>::infinity();
    return point;
  }
  point.condition = (1.0 + std::abs(product)) / std::sqrt(independent);
  Eigen::Matrix2cd gram_inverse;
  gram_inverse << 1.0, -product, -std::conj(product), 1.0;
  const Eigen::Matrix2Xcd inverse =
      scale.cwiseInverse().asDiagonal() * (gram_inverse / independent) * scaled.adjoint();
  point.H = (inverse * Y).transpose();
  // To first order δHᵀ = X⁺·(δY - δX·Hᵀ).
  const Eigen::MatrixXd variance =
      inverse.cwiseAbs2() * (Y_variance + X_variance * point.H.cwiseAbs2().transpose());
  point.deviation = variance.cwiseSqrt().transpose();
  const double coherence = *std::min_element(point.coherence.begin(), point.coherence.end());
  point.ok = coherence > limits.lowest_coherence && point.condition < limits.largest_condition &&
             point.H.allFinite();
  return point;
}

}  // namespace

std::vector<HybridPoint> estimate_hybrid_matrix(const std::vector<PortExperiment>& experiments,
                                                const std::vector<std::size_t>& harmonics,
                                                std::size_t samples_per_period, double sample_s,
                                                const EstimateLimits& limits) {
  check(experiments, samples_per_period);
  std::vector<HybridPoint> points;
  std::vector<Spectra> at_line(experiments.size());
  for (const std::size_t harmonic : harmonics) {
    const Line line(harmonic, samples_per_period);
    for (std::size_t i = 0; i < experiments.size(); ++i)
      at_line[i] = spectra(experiments[i], line, samples_per_period);
    HybridPoint point = solve(at_line, limits);
    point.frequency_Hz = static_cast<double>(harmonic) / (static_cast<double>(samples_per_period) * sample_s);
    points.push_back(point);
  }
  return points;
}

}  // namespace identification::two_port
