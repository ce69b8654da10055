#include "identification/experiments/torque_wave.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace identification::experiments {
namespace {

MultisineShape shape_of(const PreslidingConfig& config) {
  (void)checked(config);
  if (config.waveform == "sine")
    return {1 / config.lowest_Hz, config.lowest_Hz, config.lowest_Hz, config.peak_Nm};
  if (config.waveform != "multisine")
    throw std::invalid_argument("waveform = '" + config.waveform + "', expected multisine or sine");
  return {config.period_s, config.lowest_Hz, config.highest_Hz, config.peak_Nm};
}

MultisineShape shape_of(const MultisineConfig& config) {
  (void)checked(config);
  return {config.period_s, config.lowest_Hz, config.highest_Hz, config.peak_Nm};
}

}  // namespace

TorqueWave::TorqueWave(const PreslidingConfig& config, double period_s)
    : wave_(shape_of(config), period_s),
      rest_s_(config.rest_s),
      played_s_(config.periods * shape_of(config).period_s),
      repeats_(config.repeats) {}

TorqueWave::TorqueWave(const MultisineConfig& config, double period_s)
    : wave_(shape_of(config), period_s),
      rest_s_(config.rest_s),
      played_s_(config.periods * config.period_s),
      repeats_(config.repeats) {}

double TorqueWave::duration_s(int /*measurement*/) const noexcept { return rest_s_ + played_s_; }

void TorqueWave::begin(int /*measurement*/, const Reading& reading) noexcept {
  origin_rad_ = last_rad_ = reading.position_rad;
  largest_rad_ = 0.0;
  finished_ = false;
}

SetPoint TorqueWave::step(const Reading& reading) noexcept {
  const double played_s = reading.time_s - rest_s_;
  if (played_s < 0) {
    origin_rad_ = last_rad_ = reading.position_rad;
    return {};
  }
  finished_ = finished_ || played_s >= played_s_;
  if (finished_) return {};
  last_rad_ = reading.position_rad;
  largest_rad_ = std::max(largest_rad_, std::abs(last_rad_ - origin_rad_));
  return {hal::JointCommand::torque_Nm(wave_.value(played_s))};
}

std::span<const char* const> TorqueWave::result_columns() const noexcept {
  static constexpr std::array<const char*, 2> kColumns{"largest_displacement_rad", "last_displacement_rad"};
  return kColumns;
}

void TorqueWave::write_result(std::span<double> values) const noexcept {
  values[0] = largest_rad_;
  values[1] = last_rad_ - origin_rad_;
}

}  // namespace identification::experiments
