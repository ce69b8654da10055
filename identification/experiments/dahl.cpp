#include "identification/experiments/dahl.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace identification::experiments {

double Dahl::duration_s(int /*measurement*/) const noexcept {
  return config_.rest_s + config_.cycles / config_.frequency_Hz;
}

void Dahl::begin(int /*measurement*/, const Reading& reading) noexcept {
  branches_ = {};
  origin_rad_ = reading.position_rad;
  lowest_rad_ = highest_rad_ = 0.0;
  finished_ = false;
}

SetPoint Dahl::step(const Reading& reading) noexcept {
  const double played_s = reading.time_s - config_.rest_s;
  if (played_s < 0) {
    origin_rad_ = reading.position_rad;
    return {};
  }
  finished_ = finished_ || reading.time_s >= duration_s(0);
  if (finished_) return {};
  const double turns = played_s * config_.frequency_Hz;
  const double phase_rad = 2 * std::numbers::pi * (turns - std::floor(turns));
  const double displacement_rad = reading.position_rad - origin_rad_;
  lowest_rad_ = std::min(lowest_rad_, displacement_rad);
  highest_rad_ = std::max(highest_rad_, displacement_rad);
  if (turns >= 1 && std::abs(reading.command_Nm) <= config_.centre * config_.amplitude_Nm) {
    Branch& branch = branches_[std::cos(phase_rad) >= 0 ? 0 : 1];
    branch.displacement.add(reading.command_Nm, displacement_rad);
    branch.torque.add(reading.command_Nm, reading.torque_Nm);
  }
  return {hal::JointCommand::torque_Nm(config_.amplitude_Nm * std::sin(phase_rad))};
}

std::span<const char* const> Dahl::result_columns() const noexcept {
  static constexpr std::array<const char*, 4> kColumns{"stiffness_command_Nm_per_rad",
                                                       "stiffness_measured_Nm_per_rad",
                                                       "lowest_displacement_rad", "highest_displacement_rad"};
  return kColumns;
}

void Dahl::write_result(std::span<double> values) const noexcept {
  double squares = 0.0;
  double displacement = 0.0;
  double torque = 0.0;
  for (const Branch& branch : branches_) {
    squares += branch.displacement.squares();
    displacement += branch.displacement.products();
    torque += branch.torque.products();
  }
  const bool moved = displacement != 0.0;
  values[0] = moved ? squares / displacement : kUnknown;
  values[1] = moved ? torque / displacement : kUnknown;
  values[2] = lowest_rad_;
  values[3] = highest_rad_;
}

std::string Dahl::not_measured(std::size_t column) const {
  return column < 2 ? "never moved up to " + number_text(config_.amplitude_Nm) + " N·m" : "";
}

}  // namespace identification::experiments
