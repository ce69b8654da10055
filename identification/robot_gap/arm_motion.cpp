#include "identification/robot_gap/arm_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <stdexcept>

#include "identification/fit/statistics.h"
#include "identification/gap/zero_phase.h"

namespace identification::robot_gap {
namespace {

/// Products of filtered motion, and the sign of a velocity, have frequencies above those of the motion: the
/// motion is filtered and sampled this many times as high as the band.
constexpr double kMotionBands = 2.5;
constexpr double kSamplesPerBand = 20;
/// Rows of the comparison, per period of the band. steep_zero_phase() leaves nothing above half of that.
constexpr double kRowsPerBand = 3;
/// Sample rate of a recording, in bands.
constexpr double kLeastRate = 8;
/// Length of a recording, in periods of the band.
constexpr double kShortestRecording = 20;
/// A pause of so many usual steps is bridged at any rate, as in the recording of a drive.
constexpr double kBridgedSteps = 5;

double median_step_s(const ArmRecording& recording) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < recording.time_s.size(); ++i)
    steps.push_back(recording.time_s[i] - recording.time_s[i - 1]);
  return steps.empty() ? 0 : fit::median(std::move(steps));
}

/// Even samples, between the recorded ones by straight lines.
struct Even {
  double period_s = 0;
  std::size_t count = 0;
};
Even even_grid(const ArmRecording& recording) {
  const double period_s = median_step_s(recording);
  const double length_s = recording.time_s.back() - recording.time_s.front();
  return {period_s, static_cast<std::size_t>(std::floor(length_s / period_s + 1e-6)) + 1};
}

std::vector<double> evenly(const ArmRecording& recording, const Eigen::MatrixXd& values, Eigen::Index joint,
                           const Even& grid) {
  std::vector<double> result(grid.count);
  std::size_t next = 1;
  for (std::size_t i = 0; i < grid.count; ++i) {
    const double t = recording.time_s.front() + static_cast<double>(i) * grid.period_s;
    while (next + 1 < recording.time_s.size() && recording.time_s[next] < t) ++next;
    const double from = recording.time_s[next - 1];
    const double share = std::clamp((t - from) / (recording.time_s[next] - from), 0.0, 1.0);
    const auto at = static_cast<Eigen::Index>(next);
    result[i] = (1 - share) * values(joint, at - 1) + share * values(joint, at);
  }
  return result;
}

/// Every how many samples of the recording the motion is sampled.
std::size_t stride_of(double period_s, double band_Hz) {
  return static_cast<std::size_t>(std::max(1.0, std::floor(1 / (kSamplesPerBand * band_Hz * period_s))));
}

double motion_cutoff_Hz(double period_s, double band_Hz) {
  return std::min(kMotionBands * band_Hz, 0.4 / period_s);
}

std::vector<double> motion_filtered(std::span<const double> samples, double period_s, double band_Hz) {
  return gap::steep_zero_phase(samples, period_s, motion_cutoff_Hz(period_s, band_Hz));
}

void put(Eigen::MatrixXd& matrix, Eigen::Index row, const std::vector<double>& samples, std::size_t stride) {
  for (Eigen::Index i = 0; i < matrix.cols(); ++i)
    matrix(row, i) = samples[static_cast<std::size_t>(i) * stride];
}

double rms_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

std::vector<double> unit_noise(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> noise(count);
  std::ranges::generate(noise, [&] { return normal(random); });
  return noise;
}

/// What lies in the octave above twice the band, or above the band where the samples end before.
std::vector<double> above(std::span<const double> samples, double period_s, double band_Hz) {
  const double top_Hz = std::min(4 * band_Hz, 0.4 / period_s);
  const double low_Hz = top_Hz / 2;
  const std::vector<double> upper = gap::zero_phase(samples, period_s, top_Hz);
  const std::vector<double> lower = gap::zero_phase(samples, period_s, low_Hz);
  std::vector<double> result(samples.size());
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = upper[i] - lower[i];
  return result;
}

/// What is above the motion's own filter.
std::vector<double> beyond(std::span<const double> samples, double period_s, double band_Hz) {
  std::vector<double> result = gap::zero_phase(samples, period_s, std::min(5 * band_Hz, 0.3 / period_s));
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = samples[i] - result[i];
  return result;
}

constexpr std::uint64_t kNoiseSeed = 1;

}  // namespace

std::vector<double> ArmMotion::band(std::span<const double> signal) const {
  const std::vector<double> smooth = gap::steep_zero_phase(signal, period_s, band_Hz);
  std::vector<double> result;
  result.reserve(rows());
  for (std::size_t i = 0; i < smooth.size(); i += step) result.push_back(smooth[i]);
  return result;
}

double usable_band_Hz(std::span<const ArmRecording> recordings, double wanted_Hz) {
  double band_Hz = wanted_Hz;
  for (const ArmRecording& recording : recordings)
    if (const double step_s = median_step_s(recording); step_s > 0)
      band_Hz = std::min(band_Hz, 1 / (kLeastRate * step_s));
  return band_Hz;
}

double shortest_recording_s(double band_Hz) { return kShortestRecording / band_Hz; }

CutRecording cut_at_pauses(const ArmRecording& recording, double band_Hz) {
  const double bridged_s = std::max(kBridgedSteps * median_step_s(recording), 1 / (kLeastRate * band_Hz));
  const std::vector<double>& time_s = recording.time_s;
  std::vector<std::size_t> ends;  // one past the last row of each part
  for (std::size_t i = 1; i < time_s.size(); ++i)
    if (time_s[i] - time_s[i - 1] > bridged_s) ends.push_back(i);
  if (ends.empty()) return {{recording}, {}};
  const std::size_t pause = ends.front();
  ends.push_back(time_s.size());
  CutRecording cut;
  std::size_t from = 0;
  for (const std::size_t end : ends) {
    if (time_s[end - 1] - time_s[from] >= shortest_recording_s(band_Hz)) {
      std::array<char, 40> place{};
      std::snprintf(place.data(), place.size(), ", from %.3f s", time_s[from]);
      const auto first = static_cast<Eigen::Index>(from);
      const auto rows = static_cast<Eigen::Index>(end - from);
      cut.parts.push_back({recording.name + place.data(),
                           {time_s.begin() + first, time_s.begin() + first + rows},
                           recording.position_rad.middleCols(first, rows),
                           recording.torque_Nm.middleCols(first, rows)});
    } else {
      cut.left_out.push_back({time_s[from], time_s[end - 1]});
    }
    from = end;
  }
  if (cut.parts.empty()) {
    std::array<char, 200> what{};
    std::snprintf(
        what.data(), what.size(),
        ": after %.3f s there is a pause of %.3g s, and no part between pauses has the %.3g s that a "
        "band of %.3g Hz needs; lower band_Hz or record again",
        time_s[pause - 1], time_s[pause] - time_s[pause - 1], shortest_recording_s(band_Hz), band_Hz);
    throw std::invalid_argument(recording.name + what.data());
  }
  return cut;
}

ArmMotion filtered(const ArmRecording& recording, double band_Hz) {
  if (recording.time_s.size() < 2 ||
      recording.time_s.back() - recording.time_s.front() < shortest_recording_s(band_Hz))
    throw std::invalid_argument(recording.name + ": is too short: at least " +
                                std::to_string(static_cast<int>(std::ceil(shortest_recording_s(band_Hz)))) +
                                " s of motion are needed in a band of " + std::to_string(band_Hz) +
                                " Hz; the slowest recording sets the band");
  const Even grid = even_grid(recording);
  const std::size_t stride = stride_of(grid.period_s, band_Hz);
  ArmMotion motion;
  motion.name = recording.name;
  motion.band_Hz = band_Hz;
  motion.start_s = recording.time_s.front();
  motion.period_s = grid.period_s * static_cast<double>(stride);
  motion.step =
      static_cast<std::size_t>(std::max(1.0, std::floor(1 / (kRowsPerBand * band_Hz * motion.period_s))));
  const Eigen::Index joints = recording.position_rad.rows();
  const auto samples = static_cast<Eigen::Index>(1 + (grid.count - 1) / stride);
  for (Eigen::MatrixXd* matrix :
       {&motion.position_rad, &motion.velocity_rad_per_s, &motion.acceleration_rad_per_s2, &motion.torque_Nm})
    matrix->resize(joints, samples);
  for (Eigen::Index j = 0; j < joints; ++j) {
    const std::vector<double> q =
        motion_filtered(evenly(recording, recording.position_rad, j, grid), grid.period_s, band_Hz);
    const std::vector<double> v = gap::derivative(q, grid.period_s);
    put(motion.position_rad, j, q, stride);
    put(motion.velocity_rad_per_s, j, v, stride);
    put(motion.acceleration_rad_per_s2, j, gap::derivative(v, grid.period_s), stride);
    put(motion.torque_Nm, j,
        motion_filtered(evenly(recording, recording.torque_Nm, j, grid), grid.period_s, band_Hz), stride);
  }
  return motion;
}

ArmNoise noise_of(const ArmRecording& recording, double band_Hz) {
  const Even grid = even_grid(recording);
  const Eigen::Index joints = recording.position_rad.rows();
  ArmNoise noise{Eigen::VectorXd::Zero(joints), Eigen::VectorXd::Zero(joints)};
  // Both filters, tried on noise of 1.
  const std::vector<double> unit = unit_noise(grid.count, kNoiseSeed);
  const double torque_gain = rms_of(above(unit, grid.period_s, band_Hz));
  const double position_gain = rms_of(beyond(unit, grid.period_s, band_Hz));
  for (Eigen::Index j = 0; j < joints; ++j) {
    noise.torque_Nm[j] =
        fit::robust_sigma(above(evenly(recording, recording.torque_Nm, j, grid), grid.period_s, band_Hz)) /
        torque_gain;
    noise.position_rad[j] =
        rms_of(beyond(evenly(recording, recording.position_rad, j, grid), grid.period_s, band_Hz)) /
        position_gain;
  }
  return noise;
}

double velocity_noise_gain_per_s(const ArmRecording& recording, double band_Hz) {
  // Of noise with the density 2·T up to the cut-off: the integral of (2πf)²·2T.
  const double period_s = median_step_s(recording);
  const double cutoff_Hz = motion_cutoff_Hz(period_s, band_Hz);
  return 2 * std::numbers::pi * cutoff_Hz * std::sqrt(2.0 / 3 * period_s * cutoff_Hz);
}

double noise_gain(const ArmRecording& recording, double band_Hz) {
  const Even grid = even_grid(recording);
  const std::vector<double> unit =
      motion_filtered(unit_noise(grid.count, kNoiseSeed), grid.period_s, band_Hz);
  return rms_of(gap::steep_zero_phase(unit, grid.period_s, band_Hz));
}

ArmRecording with_position_noise(const ArmRecording& recording, const Eigen::VectorXd& sigma_rad,
                                 std::uint64_t seed) {
  ArmRecording noisy = recording;
  for (Eigen::Index j = 0; j < noisy.position_rad.rows(); ++j) {
    const std::vector<double> unit =
        unit_noise(static_cast<std::size_t>(noisy.position_rad.cols()), seed + static_cast<std::uint64_t>(j));
    for (Eigen::Index i = 0; i < noisy.position_rad.cols(); ++i)
      noisy.position_rad(j, i) += sigma_rad[j] * unit[static_cast<std::size_t>(i)];
  }
  return noisy;
}

}  // namespace identification::robot_gap
