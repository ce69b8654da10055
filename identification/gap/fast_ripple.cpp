#include "identification/gap/fast_ripple.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "identification/fit/statistics.h"
#include "identification/gap/wording.h"
#include "identification/gap/zero_phase.h"

namespace identification::gap {
namespace {

constexpr double kFullTurn_rad = 2 * std::numbers::pi;
/// Sixteen turns, so that a whole number of periods per turn is a line of the spectrum, with four bins per
/// ripple of 4096 periods: 80 magnets and slots behind a gear of 50.
constexpr std::size_t kFastBins = 1 << 18;
constexpr double kFastBin_rad = kFullTurn_rad / (1 << 14);
/// Below this share of the raw rate, a ripple is not confused with its alias.
constexpr double kMaxRateShare = 0.4;
/// Power over the median of the spectrum. Of noise, the largest of 2^16 exceeds the median 16 times.
constexpr double kFarAbove = 40;
/// All parts of the data have the ripple: number, distance from the mean phase, and amplitude ratio. A tone
/// in time has another phase in each.
constexpr std::size_t kParts = 4;
constexpr double kSamePhase_rad = 0.8;
constexpr double kSameAmplitude = 0.5;
constexpr double kSamePeriods = 0.02;
/// This share of the moving samples, the slowest, must show a ripple.
constexpr double kSlowShare = 0.1;
constexpr std::size_t kMinFastSamples = 1000;

/// Samples that move fast enough for the band to take a ripple away, with what it takes away.
struct FastSamples {
  std::vector<double> position_rad;
  std::vector<double> torque_Nm;
  std::vector<double> command_Nm;
  bool commanded = true;  ///< all recordings have a command
  std::vector<double> speed_rad_per_s;
};

void append(FastSamples& samples, const Signals& s) {
  if (s.raw_torque_Nm.size() < 3 || s.torque_is_command) return;
  const std::vector<double> slow = zero_phase(s.raw_torque_Nm, s.raw_period_s, s.band_Hz);
  samples.commanded = samples.commanded && s.raw_command_Nm.size() == s.raw_torque_Nm.size();
  std::vector<double> slow_command;
  if (samples.commanded) slow_command = zero_phase(s.raw_command_Nm, s.raw_period_s, s.band_Hz);
  const std::vector<double> velocity =
      derivative(zero_phase(s.raw_position_rad, s.raw_period_s, s.band_Hz), s.raw_period_s);
  const auto step = static_cast<std::size_t>(std::llround(s.period_s / s.raw_period_s));
  for (std::size_t i = 0; i < slow.size(); ++i) {
    const std::size_t at = std::min(i / step, s.moving.size() - 1);
    if (s.moving[at] == 0) continue;
    samples.position_rad.push_back(s.raw_position_rad[i]);
    samples.torque_Nm.push_back(s.raw_torque_Nm[i] - slow[i]);
    samples.command_Nm.push_back(samples.commanded ? s.raw_command_Nm[i] - slow_command[i] : 0);
    samples.speed_rad_per_s.push_back(std::abs(velocity[i]));
  }
}

/// Amplitude and phase of N periods per turn in values of the samples, where it is above the band and below
/// the rate.
std::complex<double> amplitude(const FastSamples& samples, std::span<const double> values, std::size_t from,
                               std::size_t to, double periods, double low_Hz, double high_Hz) {
  std::complex<double> sum = 0;
  std::size_t count = 0;
  for (std::size_t i = from; i < to; ++i) {
    const double hz = periods * samples.speed_rad_per_s[i] / kFullTurn_rad;
    if (hz < low_Hz || hz > high_Hz) continue;
    sum += std::polar(values[i], -periods * samples.position_rad[i]);
    ++count;
  }
  return count > 0 ? 2.0 / static_cast<double>(count) * sum : 0;
}

}  // namespace

std::optional<FastRipple> fast_ripple(std::span<const Signals> signals) {
  FastSamples samples;
  for (const Signals& s : signals) append(samples, s);
  const std::size_t count = samples.torque_Nm.size();
  if (count < kMinFastSamples) return std::nullopt;
  const double low_Hz = signals.front().band_Hz;
  const double high_Hz = kMaxRateShare / signals.front().raw_period_s;
  // Positions modulo the length of the transform: the order stays a peak, wide as the stretch resolves it.
  std::vector<double> sums(kFastBins, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const double place = std::floor(samples.position_rad[i] / kFastBin_rad);
    const double within = place - std::floor(place / kFastBins) * kFastBins;
    sums[std::min(static_cast<std::size_t>(within), kFastBins - 1)] += samples.torque_Nm[i];
  }
  std::vector<std::complex<double>> spectrum;
  Eigen::FFT<double> fft;
  fft.fwd(spectrum, sums);
  std::vector<double> power(kFastBins / 4);
  for (std::size_t k = 0; k < power.size(); ++k) power[k] = std::norm(spectrum[k]);
  const auto periods_of = [](std::size_t k) {
    return static_cast<double>(k) * kFullTurn_rad / (static_cast<double>(kFastBins) * kFastBin_rad);
  };
  const double fastest = *std::ranges::max_element(samples.speed_rad_per_s);
  std::size_t best = 0;
  for (std::size_t k = 1; k < power.size(); ++k)
    if (periods_of(k) * fastest > kFullTurn_rad * low_Hz && (best == 0 || power[k] > power[best])) best = k;
  if (best == 0 || power[best] < kFarAbove * fit::median(power)) return std::nullopt;
  const double periods = periods_of(best);
  std::array<std::complex<double>, kParts> parts{};
  std::complex<double> mean = 0;
  double largest = 0;
  for (std::size_t p = 0; p < kParts; ++p) {
    parts[p] = amplitude(samples, samples.torque_Nm, p * count / kParts, (p + 1) * count / kParts, periods,
                         low_Hz, high_Hz);
    mean += parts[p] / static_cast<double>(kParts);
    largest = std::max(largest, std::abs(parts[p]));
  }
  for (const std::complex<double>& part : parts)
    if (!(std::abs(part) > kSameAmplitude * largest) ||
        std::abs(std::arg(part * std::conj(mean))) > kSamePhase_rad)
      return std::nullopt;
  const double command_Nm =
      std::abs(amplitude(samples, samples.command_Nm, 0, count, periods, low_Hz, high_Hz));
  return FastRipple{periods, std::abs(mean),
                    samples.commanded && command_Nm > kSameAmplitude * std::abs(mean)};
}

double most_periods_shown(std::span<const Signals> signals) {
  std::vector<double> speeds;
  for (const Signals& s : signals)
    for (std::size_t i = 0; i < s.size(); ++i)
      if (s.moving[i] > 0) speeds.push_back(std::abs(s.velocity_rad_per_s[i]));
  if (speeds.empty()) return 0;
  const auto place =
      speeds.begin() + static_cast<std::ptrdiff_t>(kSlowShare * static_cast<double>(speeds.size() - 1));
  std::ranges::nth_element(speeds, place);
  return kFullTurn_rad * signals.front().band_Hz / *place;
}

std::string fast_ripple_note(std::span<const Signals> signals, const model::effects::DriveModel& found) {
  const std::optional<FastRipple> ripple = fast_ripple(signals);
  if (!ripple) return {};
  for (const model::effects::AnyEffect& effect : found.effects)
    if (const auto* cogging = std::get_if<model::effects::Cogging>(&effect))
      if (std::abs(ripple->periods_per_rev / cogging->parameters().periods_per_rev - 1) < kSamePeriods)
        return {};
  return "The measured torque repeats " + short_number(ripple->periods_per_rev) + " times a turn with " +
         short_number(ripple->amplitude_Nm) + " N·m, above the analysed band of " +
         short_number(signals.front().band_Hz) + " Hz: " +
         (ripple->commanded
              ? "its command does so too, in answer to the encoder's steps or to a ripple of the motor"
              : "a ripple of the motor or of its current sensor") +
         ". The search does not see it; recordings at lower speed bring it into the band.";
}

}  // namespace identification::gap
