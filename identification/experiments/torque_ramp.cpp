#include "identification/experiments/torque_ramp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace identification::experiments {
namespace {

/// The slope is fitted up to this many encoder steps after the first: beyond, the bristles begin to yield.
constexpr double kSlopeSteps = 3.0;
/// For a joint that the previous ramp has set in motion and that is still moving after the rest.
constexpr double kPatience_s = 10.0;

}  // namespace

double presliding_stiffness_Nm_per_rad(double torque_Nm, double displacement_rad) noexcept {
  return torque_Nm / displacement_rad;
}

double presliding_damping_Nm_s_per_rad(double inertia_kg_m2, double stiffness_Nm_per_rad) noexcept {
  return 0.2 * std::sqrt(inertia_kg_m2 * stiffness_Nm_per_rad);
}

TorqueRamp::TorqueRamp(const TorqueRampConfig& config, double encoder_step_rad, double period_s)
    : config_(checked(config)),
      encoder_step_rad_(encoder_step_rad),
      torque_filter_(config.torque_cutoff_rad_per_s, period_s) {
  if (!(encoder_step_rad > 0 && encoder_step_rad < config.breakaway_travel_rad))
    throw std::invalid_argument("breakaway_travel_rad is less than one step of the encoder");
}

double TorqueRamp::duration_s(int /*measurement*/) const noexcept {
  return config_.rest_s + config_.highest_torque_Nm / config_.rate_Nm_per_s;
}

void TorqueRamp::begin(int measurement, const Reading& reading) noexcept {
  phase_ = Phase::kRest;
  direction_ = measurement % 2 == 0 ? 1.0 : -1.0;
  origin_rad_ = reading.position_rad;
  torque_filter_.reset(0.0);  // it rests without torque; the previous ramp must not have an effect
  first_step_ = last_step_ = still_ = {};
  slid_ = false;
}

void TorqueRamp::watch(const Reading& reading) noexcept {
  const Moment now{direction_ * (reading.position_rad - origin_rad_), reading.command_Nm,
                   torque_filter_.value()};
  const double steps = now.displacement_rad / encoder_step_rad_;
  if (std::isnan(first_step_.command_Nm) && steps > 0.5) first_step_ = now;
  const double steps_after = (now.displacement_rad - first_step_.displacement_rad) / encoder_step_rad_;
  const double steps_before =
      (last_step_.displacement_rad - first_step_.displacement_rad) / encoder_step_rad_;
  // The time at which a further step appears is known to a cycle; its duration carries no information.
  if (steps_after > 0.5 && steps_after < kSlopeSteps + 0.5 &&
      (std::isnan(steps_before) || steps_after > steps_before + 0.5))
    last_step_ = now;
  if (std::abs(reading.velocity_rad_per_s) < config_.still_speed_rad_per_s) still_ = now;
  slid_ = std::abs(now.displacement_rad) >= config_.breakaway_travel_rad;
}

SetPoint TorqueRamp::step(const Reading& reading) noexcept {
  torque_filter_.step(reading.torque_Nm);
  if (phase_ == Phase::kRest) {
    origin_rad_ = reading.position_rad;
    const double rested_s = reading.time_s - config_.rest_s;
    const bool still = std::abs(reading.velocity_rad_per_s) < config_.still_speed_rad_per_s;
    if (rested_s >= kPatience_s || (still && rested_s >= 0)) {
      phase_ = Phase::kRamp;
      ramp_begin_s_ = reading.time_s;
    }
  }
  if (phase_ == Phase::kRamp) {
    watch(reading);
    const double torque_Nm = config_.rate_Nm_per_s * (reading.time_s - ramp_begin_s_);
    if (!slid_ && torque_Nm <= config_.highest_torque_Nm)
      return {hal::JointCommand::torque_Nm(direction_ * torque_Nm)};
    phase_ = Phase::kDone;
  }
  return {};
}

std::span<const char* const> TorqueRamp::result_columns() const noexcept {
  static constexpr std::array<const char*, 11> kColumns{"direction",
                                                        "first_step_rad",
                                                        "torque_command_Nm",
                                                        "torque_measured_Nm",
                                                        "stiffness_command_Nm_per_rad",
                                                        "stiffness_measured_Nm_per_rad",
                                                        "stiffness_slope_Nm_per_rad",
                                                        "damping_command_Nm_s_per_rad",
                                                        "damping_measured_Nm_s_per_rad",
                                                        "breakaway_command_Nm",
                                                        "breakaway_measured_Nm"};
  return kColumns;
}

void TorqueRamp::write_result(std::span<double> values) const noexcept {
  const double x1_rad = direction_ * first_step_.displacement_rad;
  // A joint that still creeps makes its first step before there is a significant torque.
  const auto stiffness = [x1_rad](double torque_Nm) {
    const double value = presliding_stiffness_Nm_per_rad(torque_Nm, x1_rad);
    return value > 0 ? value : kUnknown;
  };
  const double by_command = stiffness(first_step_.command_Nm);
  const double by_measured = stiffness(first_step_.measured_Nm);
  const double slope = direction_ * presliding_stiffness_Nm_per_rad(
                                        last_step_.command_Nm - first_step_.command_Nm,
                                        last_step_.displacement_rad - first_step_.displacement_rad);
  const std::array<double, 11> result{direction_,
                                      x1_rad,
                                      first_step_.command_Nm,
                                      first_step_.measured_Nm,
                                      by_command,
                                      by_measured,
                                      slope,
                                      presliding_damping_Nm_s_per_rad(config_.inertia_kg_m2, by_command),
                                      presliding_damping_Nm_s_per_rad(config_.inertia_kg_m2, by_measured),
                                      slid_ ? still_.command_Nm : kUnknown,
                                      slid_ ? still_.measured_Nm : kUnknown};
  std::copy(result.begin(), result.end(), values.begin());
}

std::string TorqueRamp::not_measured(std::size_t column) const {
  const std::string limit = number_text(config_.highest_torque_Nm) + " N·m";
  switch (column) {
    case 0: return {};
    case 4:
    case 5:
    case 7:
    case 8: return "moved before the torque had risen; let it rest for longer";
    case 6: return "showed no second encoder step before it slid";
    case 9:
    case 10: return "did not break away up to " + limit;
    default: return "never moved up to " + limit;
  }
}

}  // namespace identification::experiments
