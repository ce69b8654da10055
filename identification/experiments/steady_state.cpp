#include "identification/experiments/steady_state.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "identification/experiments/velocity_sets.h"

namespace identification::experiments {
namespace {

/// Minimum share of the commanded velocity at which a joint counts as turning.
constexpr double kFollows = 0.1;

}  // namespace

SteadyState::SteadyState(const SteadyStateConfig& config, double period_s)
    : SteadyState(config, velocities_rad_per_s(config.sets), period_s) {}

SteadyState::SteadyState(const SteadyStateConfig& config, std::vector<double> velocities_rad_per_s,
                         double period_s)
    : config_(checked(config)),
      velocities_(std::move(velocities_rad_per_s)),
      samples_per_block_(static_cast<std::int64_t>(config_.measure_s / period_s / config_.blocks)),
      torque_filter_(config.torque_cutoff_rad_per_s, period_s) {
  if (samples_per_block_ < 1)
    throw std::invalid_argument("measure_s = " + number_text(config.measure_s) + " has fewer cycles than " +
                                std::to_string(config.blocks) + " blocks");
  if (config_.settle_s * config_.torque_cutoff_rad_per_s < kForgotten)
    throw std::invalid_argument("settle_s = " + number_text(config.settle_s) +
                                " is less than the low-pass on the torque remembers, " +
                                number_text(kForgotten / config.torque_cutoff_rad_per_s) + " s");
}

double SteadyState::duration_s(int /*measurement*/) const noexcept {
  return config_.settle_s + config_.measure_s + config_.extra_s;
}

void SteadyState::begin(int measurement, const Reading& reading) noexcept {
  velocity_command_ = velocities_[static_cast<std::size_t>(measurement)];
  torque_filter_.reset(reading.torque_Nm);
  torque_ = velocity_ = BlockMean(samples_per_block_);
  finished_ = false;
}

SetPoint SteadyState::step(const Reading& reading) noexcept {
  const double torque_Nm = torque_filter_.step(reading.torque_Nm);
  if (reading.time_s >= config_.settle_s && reading.time_s < config_.settle_s + config_.measure_s) {
    torque_.add(torque_Nm);
    velocity_.add(reading.velocity_rad_per_s);
  }
  finished_ = finished_ || reading.time_s >= duration_s(0);
  return {hal::JointCommand::velocity_rad_per_s(velocity_command_)};
}

std::span<const char* const> SteadyState::result_columns() const noexcept {
  static constexpr std::array<const char*, 4> kColumns{"velocity_rad_per_s", "torque_measured_Nm",
                                                       "torque_ci95_Nm", "velocity_command_rad_per_s"};
  return kColumns;
}

void SteadyState::write_result(std::span<double> values) const noexcept {
  std::array<double, 4> result{velocity_.mean(), torque_.mean(), torque_.ci95(), velocity_command_};
  const bool turned = std::abs(velocity_.mean()) >= kFollows * std::abs(velocity_command_);
  if (!turned) std::fill_n(result.begin(), 3, kUnknown);
  std::copy(result.begin(), result.end(), values.begin());
}

std::string SteadyState::not_measured(std::size_t column) const {
  return column < 3 ? "did not turn at the commanded velocity" : "";
}

}  // namespace identification::experiments
