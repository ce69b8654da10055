#include "identification/experiments/staircase.h"

#include <cmath>
#include <stdexcept>

namespace identification::experiments {
namespace {

hal::CommandMode mode_of(const std::string& quantity) {
  if (quantity == "torque") return hal::CommandMode::kTorque;
  if (quantity == "velocity") return hal::CommandMode::kVelocity;
  throw std::invalid_argument("quantity = '" + quantity + "', expected torque or velocity");
}

}  // namespace

Staircase::Staircase(const StaircaseConfig& config)
    : config_(checked(config)), mode_(mode_of(config.quantity)) {
  const int steps = static_cast<int>(std::floor(config.highest / config.step + 1e-9));
  if (steps < 1) throw std::invalid_argument("highest is less than one step");
  for (int i = 0; i <= steps; ++i) levels_.push_back(i * config.step);
  for (int i = steps - 1; i >= -steps; --i) levels_.push_back(i * config.step);
  for (int i = -steps + 1; i <= 0; ++i) levels_.push_back(i * config.step);
}

double Staircase::duration_s(int /*measurement*/) const noexcept {
  return config_.hold_s * static_cast<double>(levels_.size());
}

void Staircase::begin(int /*measurement*/, const Reading& /*reading*/) noexcept { finished_ = false; }

SetPoint Staircase::step(const Reading& reading) noexcept {
  const auto level = static_cast<std::size_t>(reading.time_s / config_.hold_s + 1e-9);
  finished_ = finished_ || level >= levels_.size();
  return {{mode_, finished_ ? 0.0 : levels_[level]}};
}

}  // namespace identification::experiments
