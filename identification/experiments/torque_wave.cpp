#include "identification/experiments/torque_wave.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace identification::experiments {
namespace {

constexpr int kLeastPeriods = 3;  // one in which the offset rises, and two to compare

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
      period_s_(shape_of(config).period_s),
      offset_Nm_(config.offset_Nm),
      rest_s_(config.rest_s),
      played_s_(config.periods * shape_of(config).period_s),
      repeats_(config.repeats) {
  if (config.offset_Nm != 0 && config.periods < kLeastPeriods)
    throw std::invalid_argument("periods = " + std::to_string(config.periods) +
                                ", expected 3 or more with offset_Nm: creep shows from the second on");
}

TorqueWave::TorqueWave(const MultisineConfig& config, double period_s)
    : wave_(shape_of(config), period_s),
      period_s_(config.period_s),
      rest_s_(config.rest_s),
      played_s_(config.periods * config.period_s),
      repeats_(config.repeats) {}

double TorqueWave::duration_s(int /*measurement*/) const noexcept { return rest_s_ + played_s_; }

void TorqueWave::begin(int /*measurement*/, const Reading& reading) noexcept {
  origin_rad_ = last_rad_ = reading.position_rad;
  largest_rad_ = 0.0;
  period_ = 0;
  lowest_rad_ = first_lowest_rad_ = last_lowest_rad_ = kUnknown;
  finished_ = false;
}

SetPoint TorqueWave::step(const Reading& reading) noexcept {
  const double played_s = reading.time_s - rest_s_;
  if (played_s < 0) {
    origin_rad_ = last_rad_ = reading.position_rad;
    return {};
  }
  const auto turns = static_cast<int>(std::floor(played_s / period_s_ + 1e-9));
  if (!finished_ && turns > period_) {
    if (period_ > 0) last_lowest_rad_ = lowest_rad_;
    if (period_ == 1) first_lowest_rad_ = lowest_rad_;
    lowest_rad_ = reading.position_rad;
    period_ = turns;
  }
  finished_ = finished_ || played_s >= played_s_;
  if (finished_) return {};
  last_rad_ = reading.position_rad;
  lowest_rad_ = std::min(last_rad_, lowest_rad_);  // of a number and NaN the number
  largest_rad_ = std::max(largest_rad_, std::abs(last_rad_ - origin_rad_));
  const double offset_Nm = offset_Nm_ * std::min(played_s / period_s_, 1.0);
  return {hal::JointCommand::torque_Nm(wave_.value(played_s) + offset_Nm)};
}

std::span<const char* const> TorqueWave::result_columns() const noexcept {
  static constexpr std::array<const char*, 3> kColumns{"largest_displacement_rad", "last_displacement_rad",
                                                       "creep_per_period_rad"};
  return std::span(kColumns).first(offset_Nm_ != 0 ? 3 : 2);
}

void TorqueWave::write_result(std::span<double> values) const noexcept {
  values[0] = largest_rad_;
  values[1] = last_rad_ - origin_rad_;
  if (values.size() > 2) values[2] = (last_lowest_rad_ - first_lowest_rad_) / (period_ - 2);
}

}  // namespace identification::experiments
