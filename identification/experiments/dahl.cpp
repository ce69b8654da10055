#include "identification/experiments/dahl.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "identification/fit/statistics.h"

namespace identification::experiments {
namespace {

constexpr double kNormal975 = 1.96;

}  // namespace

Dahl::Dahl(const DahlConfig& config, double encoder_step_rad)
    : config_(checked(config)), encoder_step_rad_(encoder_step_rad) {
  if (!(encoder_step_rad > 0)) throw std::invalid_argument("a step of the encoder must be positive");
}

double Dahl::duration_s(int /*measurement*/) const noexcept {
  return config_.rest_s + config_.cycles / config_.frequency_Hz;
}

void Dahl::begin(int /*measurement*/, const Reading& reading) noexcept {
  branches_ = {};
  origin_rad_ = before_rad_ = reading.position_rad;
  lowest_rad_ = highest_rad_ = 0.0;
  before_Nm_ = command_step_Nm_ = 0.0;
  finished_ = false;
}

void Dahl::add_edge(Branch& branch, double command_Nm, double displacement_rad) noexcept {
  const double share = 0.5 + 0.5 * command_Nm / (config_.centre * config_.amplitude_Nm);
  const auto bin = static_cast<std::size_t>(std::clamp(share, 0.0, 1.0) * kBins);
  Edges& edges = branch.edges[std::min(bin, kBins - 1)];
  edges.count += 1;
  edges.command_Nm += (command_Nm - edges.command_Nm) / edges.count;
  edges.displacement_rad += (displacement_rad - edges.displacement_rad) / edges.count;
}

SetPoint Dahl::step(const Reading& reading) noexcept {
  const double played_s = reading.time_s - config_.rest_s;
  if (played_s < 0) {
    origin_rad_ = before_rad_ = reading.position_rad;
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
    branch.torque.add(reading.command_Nm, reading.torque_Nm);
    command_step_Nm_ = std::max(command_step_Nm_, std::abs(reading.command_Nm - before_Nm_));
    if (std::abs(reading.position_rad - before_rad_) > 0.5 * encoder_step_rad_)
      add_edge(branch, reading.command_Nm, 0.5 * (reading.position_rad + before_rad_) - origin_rad_);
  }
  before_rad_ = reading.position_rad;
  before_Nm_ = reading.command_Nm;
  return {hal::JointCommand::torque_Nm(config_.amplitude_Nm * std::sin(phase_rad))};
}

Dahl::Slope Dahl::compliance() const noexcept {
  double squares = 0, products = 0, others = 0, free = -1;
  for (const Branch& branch : branches_) {
    SlopeFit points;
    for (const Edges& edges : branch.edges)
      if (edges.count > 0) points.add(edges.command_Nm, edges.displacement_rad);
    squares += points.squares();
    products += points.products();
    others += points.y_squares();
    free += points.count() > 0 ? points.count() - 1 : 0;
  }
  if (!(products > 0)) return {};
  const double slope = products / squares;
  if (free < 1) return {slope, kUnknown};
  const double variance = std::max(others - slope * products, 0.0) / free;
  // The same in all periods: evenly distributed within the cycle, and no scatter shows it.
  const double in_cycle_rad = slope * command_step_Nm_ / std::sqrt(12.0);
  return {slope, std::hypot(fit::student_975(free) * std::sqrt(variance / squares),
                            kNormal975 * in_cycle_rad / std::sqrt(squares))};
}

Dahl::Slope Dahl::delivered() const noexcept {
  double squares = 0, products = 0, others = 0, free = -1;
  for (const Branch& branch : branches_) {
    squares += branch.torque.squares();
    products += branch.torque.products();
    others += branch.torque.y_squares();
    free += branch.torque.count() - 1;
  }
  if (!(squares > 0) || free < 1) return {};
  const double slope = products / squares;
  const double variance = std::max(others - slope * products, 0.0) / free;
  return {slope, fit::student_975(free) * std::sqrt(variance / squares)};
}

std::span<const char* const> Dahl::result_columns() const noexcept {
  static constexpr std::array<const char*, 7> kColumns{"stiffness_command_Nm_per_rad",
                                                       "stiffness_measured_Nm_per_rad",
                                                       "lowest_displacement_rad",
                                                       "highest_displacement_rad",
                                                       "stiffness_command_ci95_Nm_per_rad",
                                                       "stiffness_measured_ci95_Nm_per_rad",
                                                       "encoder_steps"};
  return kColumns;
}

void Dahl::write_result(std::span<double> values) const noexcept {
  const Slope x = compliance();
  const Slope torque = delivered();
  values[0] = 1 / x.value;
  values[1] = torque.value / x.value;
  values[2] = lowest_rad_;
  values[3] = highest_rad_;
  values[4] = values[0] * x.ci95 / x.value;
  values[5] = std::abs(values[1]) * std::hypot(x.ci95 / x.value, torque.ci95 / torque.value);
  values[6] = std::round((highest_rad_ - lowest_rad_) / encoder_step_rad_);
}

std::string Dahl::not_measured(std::size_t column) const {
  switch (column) {
    case 0:
    case 1: return "showed too few encoder steps up to " + number_text(config_.amplitude_Nm) + " N·m";
    case 4:
    case 5: return "showed too few encoder steps for an interval";
    default: return "";
  }
}

}  // namespace identification::experiments
