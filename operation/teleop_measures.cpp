#include "operation/teleop_measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace operation {
namespace {

void add_end(TeleopMeasures::End& end, const Eigen::Vector3d& p_m, double force_N, double period_s) noexcept {
  for (std::size_t i = 0; i < 3; ++i) end.p_m[i].add(p_m[static_cast<Eigen::Index>(i)]);
  end.largest_force_N = std::max(end.largest_force_N, force_N);
  end.force_squared_N2_s += force_N * force_N * period_s;
}

}  // namespace

namespace human {

double smallest_felt_vibration_m(double frequency_Hz) noexcept {
  constexpr double kFlatUpTo_Hz = 30;
  constexpr double kRisesFrom_Hz = 300;
  const double threshold_m = 1e-6 * std::pow(10.0, 28.0 / 20.0);
  const double f_Hz = std::clamp(frequency_Hz, kFlatUpTo_Hz, kRisesFrom_Hz);
  return threshold_m * std::pow(10.0, -12.0 / 20.0 * std::log2(f_Hz / kFlatUpTo_Hz));
}

}  // namespace human

// Band-pass of constant peak gain by the bilinear transform [R. Bristow-Johnson, Audio EQ Cookbook]. Four of
// quality Q together are 1/(Q·2.3) of their centre wide; an octave is 0.707.
VibrationBand::VibrationBand(double centre_Hz, double period_s) noexcept
    : centre_Hz_(centre_Hz), is_measured_(std::numbers::sqrt2 * centre_Hz < 0.5 / period_s) {
  constexpr double kQuality = 0.615;
  const double w = 2 * std::numbers::pi * centre_Hz * period_s;
  const double alpha = std::sin(w) / (2 * kQuality);
  b_ = alpha / (1 + alpha);
  a1_ = -2 * std::cos(w) / (1 + alpha);
  a2_ = (1 - alpha) / (1 + alpha);
}

void VibrationBand::reset() noexcept { sections_.fill({}); }

void VibrationBand::add(const Eigen::Vector3d& p_m) noexcept {
  if (!is_measured_) return;
  Eigen::Vector3d in_m = p_m;
  for (Section& section : sections_) {
    const Eigen::Vector3d out_m = b_ * in_m + section.first;
    section.first = section.second - a1_ * out_m;
    section.second = -b_ * in_m - a2_ * out_m;
    in_m = out_m;
  }
  squares_m2_ += in_m.squaredNorm();
  ++samples_;
}

double VibrationBand::amplitude_m() const noexcept {
  if (!is_measured_) return std::numeric_limits<double>::quiet_NaN();
  return samples_ == 0 ? 0.0 : std::sqrt(2 * squares_m2_ / static_cast<double>(samples_));
}

TeleopMeasures::TeleopMeasures(const control::Teleoperation::Config& config)
    : config_(config),
      bands_{VibrationBand(kBands_Hz[0], config.period_s), VibrationBand(kBands_Hz[1], config.period_s),
             VibrationBand(kBands_Hz[2], config.period_s)} {}

void TeleopMeasures::Range::add(double value) noexcept {
  lowest = std::fmin(lowest, value);
  highest = std::fmax(highest, value);
}

void TeleopMeasures::add(const TeleopRecord& record) noexcept {
  const bool operating = record.phase == control::TeleopPhase::kOperating && !record.clutched;
  const bool began = operating && !was_operating_;
  was_operating_ = operating;
  if (!operating) return;
  const Eigen::Vector3d p_HD_m = vector_of(record.grip_p_HD_m);
  const Eigen::Vector3d force_N = vector_of(record.held_force_H_N);
  const double hand_N = force_N.norm();
  if (began) {
    origin_m_ = p_HD_m;
    last_force_N_ = force_N;
    for (VibrationBand& band : bands_) band.reset();
  }
  ++cycles_;
  add_end(hand_, p_HD_m, hand_N, config_.period_s);
  add_end(robot_, vector_of(record.tip_p_WT_m),
          std::hypot(record.wrench_W[0], record.wrench_W[1], record.wrench_W[2]), config_.period_s);
  const bool known = std::isfinite(record.contact_force_W_N[0]);
  largest_contact_N_ = std::max(
      largest_contact_N_, vector_of(known ? record.contact_force_W_N : record.contact_estimate_W_N).norm());
  force_scale_.add(record.force_scale);
  motion_scale_.add(record.motion_scale);
  largest_stiffness_N_per_m_ = std::max(largest_stiffness_N_per_m_,
                                        record.stiffness_N_per_m * record.motion_scale / record.force_scale);
  const double step_N = (force_N - last_force_N_).norm();
  largest_step_N_ = std::max(largest_step_N_, step_N);
  if (hand_N > human::kForceResolution_N) {
    ++loaded_cycles_;
    if (step_N > human::kForceShare * hand_N) ++rough_cycles_;
  }
  last_force_N_ = force_N;
  for (VibrationBand& band : bands_) band.add(p_HD_m - origin_m_);
}

double TeleopMeasures::operating_s() const noexcept {
  return static_cast<double>(cycles_) * config_.period_s;
}

double TeleopMeasures::rms_N(const End& end) const noexcept {
  return cycles_ == 0 ? 0.0 : std::sqrt(end.force_squared_N2_s / operating_s());
}

double TeleopMeasures::rough_share() const noexcept {
  return loaded_cycles_ == 0 ? 0.0 : static_cast<double>(rough_cycles_) / static_cast<double>(loaded_cycles_);
}

}  // namespace operation
