#include "model/friction/law_compensator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

namespace model::friction {
namespace {

LawCompensator::Config checked_config(const LawCompensator::Config& config) {
  if (!(config.margin >= 0 && config.margin < 1))
    throw std::invalid_argument("law compensator: margin = " + std::to_string(config.margin) +
                                ", expected 0 to below 1");
  if (!(config.quiet_speed_rad_per_s >= 0 && config.blend_speed_rad_per_s > config.quiet_speed_rad_per_s &&
        std::isfinite(config.blend_speed_rad_per_s)))
    throw std::invalid_argument(
        "law compensator: blend_speed_rad_per_s = " + std::to_string(config.blend_speed_rad_per_s) +
        " must be above quiet_speed_rad_per_s = " + std::to_string(config.quiet_speed_rad_per_s) +
        ", which must not be negative");
  return config;
}

/// Factor on the compensation at which it balances friction; infinite if it does not drive.
double balance(double taken, double brought) noexcept {
  return brought > 0 ? taken / brought : std::numeric_limits<double>::infinity();
}

double steady_gain(const AnyLaw& friction, const LawCompensator& compensator, double top_speed_rad_per_s) {
  constexpr int kSpeeds = 2000;
  double gain = std::numeric_limits<double>::infinity();
  for (int i = 1; i <= kSpeeds; ++i)
    for (const double sign : {-1.0, 1.0}) {
      const double velocity = sign * top_speed_rad_per_s * i / kSpeeds;
      gain = std::min(gain, balance(friction.steady_Nm(velocity) * velocity,
                                    compensator.from_measured_Nm(velocity) * velocity));
    }
  return gain;
}

/// The second period after rest; the first one is the transient.
double cycle_gain(const AnyLaw& friction, const LawCompensator& compensator, double amplitude_rad_per_s,
                  double frequency_Hz) {
  constexpr int kSteps = 200;
  const double dt_s = 1 / (frequency_Hz * kSteps);
  State state;
  double taken_J = 0.0, brought_J = 0.0, stored_J = 0.0;
  for (int n = 0; n < 2 * kSteps; ++n) {
    if (n == kSteps) stored_J = friction.stored_energy_J(state);
    const double velocity = amplitude_rad_per_s * std::sin(2 * std::numbers::pi * (n + 0.5) / kSteps);
    const double torque_Nm = friction.step(state, {velocity, 0.0}, dt_s);
    if (n < kSteps) continue;
    taken_J += torque_Nm * velocity * dt_s;
    brought_J += compensator.from_measured_Nm(velocity) * velocity * dt_s;
  }
  return balance(taken_J - (friction.stored_energy_J(state) - stored_J), brought_J);
}

}  // namespace

SlidingTable law_table(const AnyLaw& law, const SlidingTable::Grid& grid) {
  return {[&law](double velocity) { return law.steady_Nm(velocity); }, grid};
}

LawCompensator::LawCompensator(const AnyLaw& law, const Config& config)
    : LawCompensator(law_table(law, config.grid), config) {}

LawCompensator::LawCompensator(SlidingTable table, const Config& config)
    : table_(std::move(table)), config_(checked_config(config)) {}

double LawCompensator::direction(double velocity_rad_per_s) const noexcept {
  const double share = (std::abs(velocity_rad_per_s) - config_.quiet_speed_rad_per_s) /
                       (config_.blend_speed_rad_per_s - config_.quiet_speed_rad_per_s);
  // Written so that NaN counts as no motion.
  return share > 0 ? std::copysign(std::min(share, 1.0), velocity_rad_per_s) : 0.0;
}

double LawCompensator::from_measured_Nm(double measured_rad_per_s) const noexcept {
  const double share = direction(measured_rad_per_s);
  return share == 0 ? 0.0 : config_.margin * share * table_.level_Nm(measured_rad_per_s);
}

double LawCompensator::from_command_Nm(double commanded_rad_per_s, double measured_rad_per_s) const noexcept {
  const double share = direction(commanded_rad_per_s);
  if (share == 0 || std::isnan(measured_rad_per_s)) return 0.0;
  const double along = std::max(0.0, std::copysign(1.0, share) * measured_rad_per_s);
  const double holding = std::min(table_.breakaway_Nm(share), table_.level_Nm(std::copysign(along, share)));
  return config_.margin * share * std::min(table_.level_Nm(commanded_rad_per_s), holding);
}

double max_passive_gain(const AnyLaw& friction, const LawCompensator& compensator,
                        const PassivityRange& range) {
  if (!(range.top_speed_rad_per_s > 0 && range.lowest_frequency_Hz > 0 &&
        range.highest_frequency_Hz >= range.lowest_frequency_Hz && std::isfinite(range.top_speed_rad_per_s) &&
        std::isfinite(range.highest_frequency_Hz)))
    throw std::invalid_argument("passivity range: speeds and frequencies must be positive and ordered");
  constexpr int kAmplitudes = 28, kFrequencies = 9;
  double gain = steady_gain(friction, compensator, range.top_speed_rad_per_s);
  for (int f = 0; f < kFrequencies; ++f) {
    const double frequency_Hz =
        range.lowest_frequency_Hz * std::pow(range.highest_frequency_Hz / range.lowest_frequency_Hz,
                                             static_cast<double>(f) / (kFrequencies - 1));
    for (int a = 0; a < kAmplitudes; ++a)
      gain = std::min(gain,
                      cycle_gain(friction, compensator,
                                 range.top_speed_rad_per_s * std::pow(10, -4.0 + 4.0 * a / (kAmplitudes - 1)),
                                 frequency_Hz));
  }
  return gain;
}

bool is_passive(const AnyLaw& friction, const LawCompensator& compensator, const PassivityRange& range) {
  return max_passive_gain(friction, compensator, range) >= 1;
}

}  // namespace model::friction
