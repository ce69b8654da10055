/// @file
/// Wrench control of the base: spring and damper to a reference (thesis 2.7.2, figure 30).
#pragma once
#include <optional>

#include "control/base_drive.h"
#include "control/base_path.h"

namespace control {

/// W = Rᵀ·[K·(p_ref − p) + D·(v_ref − v) + M·a_ref], applied by a BaseDrive
/// Cycle: reset() and step() neither allocate nor lock.
class BaseController {
 public:
  struct Config : BaseDrive::Config {
    PlanarVector stiffness = {150, 150, 22};  ///< K [N/m, N/m, N·m/rad]
    PlanarVector damping = {150, 150, 22};    ///< D [N·s/m, N·s/m, N·m·s/rad]
    /// M [kg, kg, kg·m²]: the body (29.5, 4.0) and, reflected to the floor, wheels and rotors (18.8, 2.8).
    PlanarVector feedforward_inertia = {48, 48, 6.8};
  };
  struct Output : BaseDrive::State, BaseDrive::Torques {};

  /// Setup. @throws std::invalid_argument naming the value that is out of range.
  explicit BaseController(const Config& config);

  /// As in BaseDrive.
  void reset(const WheelVector& wheel_position_rad, const PlanarPose& X_WB = {}) noexcept {
    drive_.reset(wheel_position_rad, X_WB);
  }
  void forget_velocity(const WheelVector& wheel_position_rad) noexcept {
    drive_.forget_velocity(wheel_position_rad);
  }

  /// `elapsed_s` as in BaseDrive::sense(), here and below.
  Output step(const WheelVector& wheel_position_rad, const BaseReference& reference,
              std::optional<double> elapsed_s = {}) noexcept;
  /// Measures without driving, for cycles with drives off: zero torque and wrench.
  Output observe(const WheelVector& wheel_position_rad, std::optional<double> elapsed_s = {}) noexcept {
    return {drive_.sense(wheel_position_rad, elapsed_s), {}};
  }
  /// Stops without a reference: damping towards rest, no spring, no friction compensation.
  Output brake(const WheelVector& wheel_position_rad, std::optional<double> elapsed_s = {}) noexcept;

 private:
  Config config_;
  BaseDrive drive_;
};

}  // namespace control
