#include "control/base_controller.h"

#include <stdexcept>

namespace control {
namespace {

BaseController::Config checked(const BaseController::Config& config) {
  const auto usable = [](const PlanarVector& gain) { return gain.allFinite() && (gain.array() >= 0).all(); };
  if (!usable(config.stiffness) || !usable(config.damping) || !usable(config.feedforward_inertia))
    throw std::invalid_argument("base controller: gains must be finite and not negative");
  return config;
}

}  // namespace

BaseController::BaseController(const Config& config) : config_(checked(config)), drive_(config) {}

BaseController::Output BaseController::step(const WheelVector& wheel_position_rad,
                                            const BaseReference& reference,
                                            std::optional<double> elapsed_s) noexcept {
  const BaseDrive::State state = drive_.sense(wheel_position_rad, elapsed_s);
  const PlanarPose& X_WB = state.X_WB;
  const PlanarVector error_W(reference.X_WB.x_m - X_WB.x_m, reference.X_WB.y_m - X_WB.y_m,
                             reference.X_WB.yaw_rad - X_WB.yaw_rad);
  // Gains are for the axes of the base frame, so errors are rotated into it first.
  return {state,
          drive_.drive(
              config_.stiffness.cwiseProduct(rotated(error_W, -X_WB.yaw_rad)) +
              config_.damping.cwiseProduct(rotated(reference.twist_W, -X_WB.yaw_rad) - state.twist_B) +
              config_.feedforward_inertia.cwiseProduct(rotated(reference.acceleration_W, -X_WB.yaw_rad)))};
}

BaseController::Output BaseController::brake(const WheelVector& wheel_position_rad,
                                             std::optional<double> elapsed_s) noexcept {
  const BaseDrive::State state = drive_.sense(wheel_position_rad, elapsed_s);
  return {state, drive_.drive_uncompensated(-config_.damping.cwiseProduct(state.twist_B))};
}

}  // namespace control
