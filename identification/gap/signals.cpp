#include "identification/gap/signals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <stdexcept>

#include "identification/fit/statistics.h"
#include "identification/gap/even_rows.h"
#include "identification/gap/quantum.h"
#include "identification/gap/wording.h"
#include "identification/gap/zero_phase.h"

namespace identification::gap {
namespace {

constexpr double kWidestBand_Hz = 25;
/// Samples kept per period of the band's edge.
constexpr double kOversampling = 20;
/// Cutoff of the signals' filter relative to the band, if the sample rate allows.
constexpr double kFilterOverBand = 6;
constexpr double kMaxSampleRateShare = 0.25;
/// In periods of the filter's edge: this close to a standstill the filter mixes in the torque that held the
/// joint.
constexpr double kFromStandstill = 0.25;
constexpr double kFromSaturation = 1;
constexpr double kUsualCommands = 0.9;

/// Encoder noise may reach this share of the torque if the torque sensor has less noise.
constexpr double kAllowedNoiseShare = 0.01;
constexpr std::size_t kMinSamples = 100;
/// Of a sensor.
constexpr double kMinLevels = 8;

[[noreturn]] void refuse(const Source& source, const std::string& why) {
  throw std::invalid_argument(path_of(source) + ": " + why);
}

EvenRows even_rows_of(const Source& source) {
  if (const std::size_t rows = source.recording.column("time_s").size(); rows < kMinSamples)
    refuse(source, "has " + std::to_string(rows) + " rows, too few to tell motion from; " +
                       std::to_string(kMinSamples) + " are the least; record a staircase or multisine");
  return EvenRows(source);
}

/// "; its columns are time_s, q".
std::string names_of(const Recording& recording) {
  std::string names;
  for (const Recording::Column& column : recording.columns)
    (names += names.empty() ? "" : ", ") += column.name;
  return "; its columns are " + names;
}

/// At the recording's own times.
std::vector<double> position_of(const Source& source) {
  const Recording& recording = source.recording;
  if (recording.has("position_rad")) {
    const auto column = recording.column("position_rad");
    return {column.begin(), column.end()};
  }
  if (!recording.has("velocity_rad_per_s"))
    refuse(source, "has no position_rad (nor velocity_rad_per_s); nothing can be said about motion" +
                       names_of(recording));
  const auto time = recording.column("time_s");
  const auto velocity = recording.column("velocity_rad_per_s");
  std::vector<double> position(velocity.size());
  for (std::size_t i = 1; i < position.size(); ++i)
    position[i] = position[i - 1] + 0.5 * (velocity[i] + velocity[i - 1]) * (time[i] - time[i - 1]);
  return position;
}

std::span<const double> torque_of(const Source& source) {
  for (const char* name : {"torque_measured_Nm", "torque_command_Nm"})
    if (source.recording.has(name)) return source.recording.column(name);
  refuse(source, "has neither torque_measured_Nm nor torque_command_Nm" + names_of(source.recording));
}

/// Share of the segment from `a` to `b` that is above zero.
double share_above_zero(double a, double b) {
  if (a >= 0 && b >= 0) return 1;
  if (a <= 0 && b <= 0) return 0;
  return std::max(a, b) / std::abs(a - b);
}

/// Mean sign over half a period to both sides of each sample: between two of them the velocity reverses where
/// the interpolation does, not at the next sample.
std::vector<double> mean_signs(const std::vector<double>& velocity) {
  std::vector<double> result;
  result.reserve(velocity.size());
  for (std::size_t i = 0; i < velocity.size(); ++i) {
    const double v = velocity[i];
    const double before = 0.5 * (v + velocity[i > 0 ? i - 1 : i]);
    const double after = 0.5 * (v + velocity[std::min(i + 1, velocity.size() - 1)]);
    result.push_back(share_above_zero(before, v) + share_above_zero(v, after) - 1);
  }
  return result;
}

/// Sets to 0 all samples within `margin` samples of those marked by `apart`.
template <class Apart>
void leave_out(std::vector<double>& weights, std::size_t margin, const Apart& apart) {
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (!apart(i)) continue;
    const std::size_t from = i - std::min(i, margin);
    const std::size_t to = std::min(i + margin + 1, weights.size());
    std::fill(weights.begin() + static_cast<std::ptrdiff_t>(from),
              weights.begin() + static_cast<std::ptrdiff_t>(to), 0.0);
  }
}

/// The smallest step between values, robustly: the encoder's resolution; 0 if continuous.
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

/// That of a torque sensor. A torque that steps between a few levels is commanded so.
double torque_resolution(std::span<const double> torque) {
  const std::optional<double> quantum = quantum_of(torque);
  const auto [low, high] = std::ranges::minmax(torque);
  return quantum && *quantum * kMinLevels < high - low ? *quantum : 0;
}

/// Sample-to-sample noise, from second differences: a smooth signal leaves none.
double sample_sigma(std::span<const double> values) {
  std::vector<double> differences;
  for (std::size_t i = 2; i < values.size(); ++i)
    differences.push_back(values[i] - 2 * values[i - 1] + values[i - 2]);
  return fit::robust_sigma(std::move(differences)) / std::sqrt(6.0);
}

double rms(std::span<const double> values) {
  double square = 0;
  for (const double value : values) square += value * value;
  return std::sqrt(square / static_cast<double>(std::max<std::size_t>(1, values.size())));
}

std::vector<double> every(std::span<const double> values, std::size_t step) {
  std::vector<double> kept;
  for (std::size_t i = 0; i < values.size(); i += step) kept.push_back(values[i]);
  return kept;
}

}  // namespace

Band choose_band(const std::vector<Source>& sources, const model::effects::DriveModel& base) {
  Band band;
  std::vector<double> densities;  // sigma·√T: filtered noise does not depend on the rate
  std::vector<double> torques;
  std::vector<double> resolutions;
  std::vector<double> quanta;
  double fastest = 0;
  bool moves = false;
  for (const Source& source : sources) {
    const EvenRows rows = even_rows_of(source);
    const double period_s = rows.period_s();
    band.raw_period_s = std::max(band.raw_period_s, period_s);
    const std::vector<double> position = position_of(source);
    resolutions.push_back(resolution(position));
    if (base.encoder_ticks_per_rev && source.recording.has("position_rad"))
      quanta.push_back(quantum_of(position).value_or(0));
    const auto torque = torque_of(source);
    densities.push_back(std::hypot(sample_sigma(torque), torque_resolution(torque) / std::sqrt(12.0)) *
                        std::sqrt(period_s));
    torques.push_back(rms(torque));
    const std::vector<double> even = rows.of(position, Between::kCurve);
    const std::vector<double> smooth =
        derivative(zero_phase(even, period_s, std::min(5.0, 0.1 / period_s)), period_s);
    for (const double v : smooth) fastest = std::max(fastest, std::abs(v));
  }
  band.resolution_rad = fit::median(resolutions);
  // The steps of a model and those of the data may be of different encoders: the coarser one blurs the
  // motion.
  if (base.encoder_ticks_per_rev) {
    band.resolution_rad = 2 * std::numbers::pi / *base.encoder_ticks_per_rev;
    if (!quanta.empty()) band.resolution_rad = std::max(band.resolution_rad, fit::median(quanta));
  }
  band.torque_sigma_Nm = fit::median(densities) / std::sqrt(band.raw_period_s);
  // Steps of q at rate 1/T are white noise of q/√12; twice differentiated and low-passed at ω it has about
  // q/√12·ω²·√(2·f·T/5), the torque √(2·f·T) of its own.
  const double q = band.resolution_rad / std::sqrt(12.0);
  const double allowed = std::max(band.torque_sigma_Nm, kAllowedNoiseShare * fit::median(torques));
  band.cutoff_Hz = std::min(kWidestBand_Hz, 0.1 / band.raw_period_s);
  while (band.cutoff_Hz > 2) {
    const double omega = 2 * std::numbers::pi * band.cutoff_Hz;
    if (base.inertia_kg_m2 * q * omega * omega / std::sqrt(5.0) <= allowed) break;
    band.cutoff_Hz *= 0.9;
  }
  band.slowest_rad_per_s =
      std::max(4 * kFilterOverBand * band.resolution_rad * band.cutoff_Hz, 1e-3 * fastest);
  const double least = band.resolution_rad > 0 ? 20 * band.resolution_rad : 1e-9;
  for (const Source& source : sources) {
    const std::vector<double> position = position_of(source);
    const auto [low, high] = std::minmax_element(position.begin(), position.end());
    moves = moves || *high - *low > least;
  }
  if (!moves) {
    std::string paths;
    for (const Source& source : sources) paths += (paths.empty() ? "" : ", ") + path_of(source);
    throw std::invalid_argument(
        paths +
        ": no recording moves: friction and inertia show only in motion; record a staircase or "
        "multisine");
  }
  return band;
}

std::vector<double> at_samples(std::span<const double> held) {
  std::vector<double> result(held.begin(), held.end());
  for (std::size_t i = held.size(); i-- > 1;) result[i] = 0.5 * (held[i - 1] + held[i]);
  return result;
}

std::vector<double> since_reversal(std::span<const double> velocity_rad_per_s, double period_s) {
  std::vector<double> since_s(velocity_rad_per_s.size());
  for (std::size_t i = 1; i < since_s.size(); ++i)
    since_s[i] = velocity_rad_per_s[i] * velocity_rad_per_s[i - 1] <= 0 ? 0 : since_s[i - 1] + period_s;
  return since_s;
}

Signals make_signals(const Source& source, const Band& band) {
  const Recording& recording = source.recording;
  const EvenRows own_rows = even_rows_of(source);
  const double own_period_s = own_rows.period_s();
  const std::vector<double>& time = own_rows.sampled_at_s();
  Signals s;
  s.name = source.name;
  // The recordings' own rates, if they are equal.
  const bool slower = band.raw_period_s > (1 + 1e-3) * own_period_s;
  s.raw_period_s = slower ? band.raw_period_s : own_period_s;
  s.band_Hz = band.cutoff_Hz;
  s.filter_Hz = std::min(kFilterOverBand * band.cutoff_Hz, kMaxSampleRateShare / band.raw_period_s);
  const auto step = static_cast<std::size_t>(
      std::max(1.0, std::floor(1 / (kOversampling * band.cutoff_Hz * band.raw_period_s))));
  s.period_s = s.raw_period_s * static_cast<double>(step);

  const auto even = [&](std::span<const double> values, Between between = Between::kLine) {
    return own_rows.of(values, between);
  };
  // From even values at the recording's own rate to the common one.
  std::vector<double> own_times;
  for (std::size_t i = 0; i < time.size(); ++i)
    own_times.push_back(time.front() + static_cast<double>(i) * own_period_s);
  const auto count = static_cast<std::size_t>((time.back() - time.front()) / s.raw_period_s * (1 + 1e-9)) + 1;
  const auto common = [&](std::vector<double> values, Between between = Between::kLine) {
    return slower ? interpolated(own_times, values, s.raw_period_s, count, between) : values;
  };
  const auto kept = [&](std::vector<double> values) {
    return every(common(std::move(values), Between::kCurve), step);
  };
  const std::vector<double> as_measured = even(position_of(source), Between::kCurve);
  s.raw_position_rad = common(as_measured, Between::kCurve);
  const std::vector<double> position = steep_zero_phase(as_measured, own_period_s, s.filter_Hz);
  const std::vector<double> velocity = derivative(position, own_period_s);
  const std::vector<double> acceleration = derivative(velocity, own_period_s);
  s.time_s = kept(own_times);
  s.recorded_from_s = s.time_s.front();
  s.recorded_to_s = s.time_s.back();
  for (const double t : s.time_s) s.running_s.push_back(t - source.running_from_s.value_or(time.front()));
  s.position_rad = kept(position);
  s.velocity_rad_per_s = kept(velocity);
  s.since_reversal_s = since_reversal(s.velocity_rad_per_s, s.period_s);
  s.acceleration_rad_per_s2 = kept(acceleration);
  s.direction = kept(steep_zero_phase(mean_signs(velocity), own_period_s, s.filter_Hz));
  const auto samples = [&](double periods) {
    return static_cast<std::size_t>(std::lround(periods / (s.filter_Hz * s.period_s)));
  };
  s.moving.assign(s.velocity_rad_per_s.size(), 1.0);
  leave_out(s.moving, samples(kFromStandstill),
            [&](std::size_t i) { return std::abs(s.velocity_rad_per_s[i]) <= band.slowest_rad_per_s; });
  if (recording.has(kSaturated)) {
    const std::vector<double> saturated = kept(even(recording.column(kSaturated)));
    leave_out(s.moving, samples(kFromSaturation), [&](std::size_t i) { return saturated[i] > 0; });
  }
  s.raw_torque_Nm = common(even(torque_of(source)));
  s.torque_is_command = !recording.has("torque_measured_Nm");
  s.signed_by_motion = source.signed_by_motion;
  const std::vector<double> raw_torque = even(torque_of(source));
  const std::vector<double> torque =
      steep_zero_phase(s.torque_is_command ? at_samples(raw_torque) : raw_torque, own_period_s, s.filter_Hz);
  s.torque_Nm = kept(torque);
  const std::vector<double> torque_rate = derivative(torque, own_period_s);
  s.torque_rate_Nm_per_s = kept(torque_rate);
  s.torque_bend_Nm_per_s2 = kept(derivative(torque_rate, own_period_s));
  if (recording.has("torque_command_Nm")) {
    s.raw_command_Nm = common(even(recording.column("torque_command_Nm")));
    if (!s.torque_is_command) {
      s.raw_measured_Nm = common(even(recording.column("torque_measured_Nm")));
    }
  }
  if (recording.has("velocity_command_rad_per_s")) {
    s.raw_velocity_command_rad_per_s = common(even(recording.column("velocity_command_rad_per_s")));
    s.raw_velocity_rad_per_s = recording.has("velocity_rad_per_s")
                                   ? common(even(recording.column("velocity_rad_per_s")))
                                   : common(derivative(even(position_of(source)), own_period_s));
  }
  return s;
}

double widest_span_rad(std::span<const Signals> signals) {
  double widest = 0;
  double low = 0;
  double high = 0;
  for (std::size_t i = 0; i < signals.size(); ++i) {
    const auto [own_low, own_high] = std::ranges::minmax(signals[i].position_rad);
    const bool goes_on = i > 0 && signals[i].source == signals[i - 1].source;
    low = goes_on ? std::min(low, own_low) : own_low;
    high = goes_on ? std::max(high, own_high) : own_high;
    widest = std::max(widest, high - low);
  }
  return widest;
}

double farthest_rad(std::span<const Signals> signals) {
  double farthest = 0;
  for (const Signals& s : signals) {
    const auto [low, high] = std::ranges::minmax(s.position_rad);
    farthest = std::max({farthest, std::abs(low), std::abs(high)});
  }
  return farthest;
}

double usual_command_Nm(std::span<const Signals> signals) {
  std::vector<double> magnitudes;
  for (const Signals& s : signals)
    for (const double command : s.raw_command_Nm) magnitudes.push_back(std::abs(command));
  if (magnitudes.empty()) return 0;
  const auto place = magnitudes.begin() +
                     static_cast<std::ptrdiff_t>(kUsualCommands * static_cast<double>(magnitudes.size() - 1));
  std::ranges::nth_element(magnitudes, place);
  return *place;
}

}  // namespace identification::gap
