#include "sim/gap/signals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <stdexcept>

#include "sim/gap/zero_phase.h"
#include "sim/identify/sampling.h"

namespace sim::gap {
namespace {

constexpr double kWidestBand_Hz = 25;
/// Samples per period of the band's edge that are kept.
constexpr double kOversampling = 20;
/// Cutoff of the signals' filter over the band, as far as the sample rate allows.
constexpr double kFilterOverBand = 6;
constexpr double kMostOfSampleRate = 0.25;

[[noreturn]] void refuse(const Source& source, const std::string& why) {
  throw std::invalid_argument(source.name + ": " + why);
}

std::vector<double> position_of(const Source& source, double period_s) {
  const Recording& recording = source.recording;
  if (recording.has("position_rad")) {
    const auto column = recording.column("position_rad");
    return {column.begin(), column.end()};
  }
  if (!recording.has("velocity_rad_per_s"))
    refuse(source, "has no position_rad (nor velocity_rad_per_s); nothing can be said about motion");
  std::vector<double> position;
  double sum = 0;
  for (const double velocity : recording.column("velocity_rad_per_s"))
    position.push_back(sum += velocity * period_s);
  return position;
}

std::span<const double> torque_of(const Source& source) {
  for (const char* name : {"torque_measured_Nm", "torque_command_Nm"})
    if (source.recording.has(name)) return source.recording.column(name);
  refuse(source, "has neither torque_measured_Nm nor torque_command_Nm");
}

/// The smallest step that values take, robustly: the encoder's or sensor's resolution; 0 when continuous.
double resolution(std::span<const double> values) {
  double smallest = std::numeric_limits<double>::infinity();
  std::size_t steps = 0;
  std::size_t equal = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double step = std::abs(values[i] - values[i - 1]);
    if (step == 0) {
      ++equal;
    } else {
      ++steps;
      smallest = std::min(smallest, step);
    }
  }
  return steps > 0 && equal > steps / 1000 ? smallest : 0;
}

/// Of sample to sample noise, from second differences: a smooth signal leaves none.
double sample_sigma(std::span<const double> values) {
  std::vector<double> differences;
  for (std::size_t i = 2; i < values.size(); ++i)
    differences.push_back(values[i] - 2 * values[i - 1] + values[i - 2]);
  return identify::robust_sigma(std::move(differences)) / std::sqrt(6.0);
}

std::vector<double> every(std::span<const double> values, std::size_t step) {
  std::vector<double> kept;
  for (std::size_t i = 0; i < values.size(); i += step) kept.push_back(values[i]);
  return kept;
}

}  // namespace

Band choose_band(const std::vector<Source>& sources, const effects::DriveModel& base) {
  Band band;
  double longest_period_s = 0;
  std::vector<double> sigmas;
  std::vector<double> resolutions;
  double fastest = 0;
  for (const Source& source : sources) {
    const double period_s = [&] {
      try {
        return identify::even_period_s(source.recording);
      } catch (const std::invalid_argument& error) {
        refuse(source, error.what());
      }
    }();
    longest_period_s = std::max(longest_period_s, period_s);
    const std::vector<double> position = position_of(source, period_s);
    resolutions.push_back(resolution(position));
    const auto torque = torque_of(source);
    sigmas.push_back(std::hypot(sample_sigma(torque), resolution(torque) / std::sqrt(12.0)));
    const std::vector<double> smooth =
        derivative(zero_phase(position, period_s, std::min(5.0, 0.1 / period_s)), period_s);
    for (const double v : smooth) fastest = std::max(fastest, std::abs(v));
  }
  band.resolution_rad = identify::median(resolutions);
  if (base.encoder_ticks_per_rev) band.resolution_rad = 2 * std::numbers::pi / *base.encoder_ticks_per_rev;
  band.torque_sigma_Nm = identify::median(sigmas);
  // Steps of q at rate 1/T are white noise of q/√12; twice differentiated and low-passed at ω it has about
  // q/√12·ω²·√(2·f·T/5), the torque √(2·f·T) of its own.
  const double q = band.resolution_rad / std::sqrt(12.0);
  band.cutoff_Hz = std::min(kWidestBand_Hz, 0.1 / longest_period_s);
  while (band.cutoff_Hz > 2) {
    const double omega = 2 * std::numbers::pi * band.cutoff_Hz;
    if (base.inertia_kg_m2 * q * omega * omega / std::sqrt(5.0) <= band.torque_sigma_Nm) break;
    band.cutoff_Hz *= 0.9;
  }
  band.slowest_rad_per_s =
      std::max(4 * kFilterOverBand * band.resolution_rad * band.cutoff_Hz, 1e-3 * fastest);
  const double least = band.resolution_rad > 0 ? 20 * band.resolution_rad : 1e-9;
  bool moves = false;
  for (const Source& source : sources) {
    const std::vector<double> position = position_of(source, longest_period_s);
    const auto [low, high] = std::minmax_element(position.begin(), position.end());
    moves = moves || *high - *low > least;
  }
  if (!moves)
    throw std::invalid_argument(
        "no recording moves: friction and inertia show only in motion; record a staircase or multisine");
  return band;
}

Signals make_signals(const Source& source, const Band& band) {
  Signals s;
  s.name = source.name;
  s.raw_period_s = identify::even_period_s(source.recording);
  s.band_Hz = band.cutoff_Hz;
  s.filter_Hz = std::min(kFilterOverBand * band.cutoff_Hz, kMostOfSampleRate / s.raw_period_s);
  const auto step = static_cast<std::size_t>(
      std::max(1.0, std::floor(1 / (kOversampling * band.cutoff_Hz * s.raw_period_s))));
  s.period_s = s.raw_period_s * static_cast<double>(step);
  const auto low_pass = [&](std::span<const double> raw) {
    return zero_phase(raw, s.raw_period_s, s.filter_Hz);
  };
  s.raw_position_rad = position_of(source, s.raw_period_s);
  const std::vector<double> position = low_pass(s.raw_position_rad);
  const std::vector<double> velocity = derivative(position, s.raw_period_s);
  const std::vector<double> acceleration = derivative(velocity, s.raw_period_s);
  const auto torque = torque_of(source);
  s.raw_torque_Nm.assign(torque.begin(), torque.end());
  std::vector<double> moving(velocity.size());
  for (std::size_t i = 0; i < velocity.size(); ++i) {
    moving[i] = std::abs(velocity[i]) > band.slowest_rad_per_s ? 1.0 : 0.0;
  }
  const auto time = source.recording.column("time_s");
  s.time_s = every(time, step);
  for (const double t : s.time_s) s.running_s.push_back(t - time.front());
  s.position_rad = every(position, step);
  s.velocity_rad_per_s = every(velocity, step);
  s.acceleration_rad_per_s2 = every(acceleration, step);
  s.moving = every(moving, step);
  const std::vector<double> smooth_torque = low_pass(torque);
  s.torque_Nm = every(smooth_torque, step);
  s.torque_rate_Nm_per_s = every(derivative(smooth_torque, s.raw_period_s), step);
  s.torque_is_command = !source.recording.has("torque_measured_Nm");
  if (source.recording.has("torque_command_Nm")) {
    const auto command = source.recording.column("torque_command_Nm");
    s.raw_command_Nm.assign(command.begin(), command.end());
    if (!s.torque_is_command) {
      s.command_Nm = every(low_pass(command), step);
      const auto measured = source.recording.column("torque_measured_Nm");
      s.raw_measured_Nm.assign(measured.begin(), measured.end());
    }
  }
  return s;
}

}  // namespace sim::gap
