/// @file
/// Simulation of a drive model: exactly the content of its file.
#pragma once
#include <span>

#include "model/effects/drive_model.h"
#include "sim/moving_parts.h"

namespace sim {

/// Torque command in; motion, delivered and reported torque out, without noise or quantisation. The current
/// loop is ideal: its imperfections are actuator effects. One thread; step() neither allocates nor locks.
class ModelDrive {
 public:
  /// `step_s`: sample period; a command holds that long, and each is integrated in `substeps` parts, or in
  /// more if a friction law of the model needs shorter ones.
  /// @throws std::invalid_argument for a model without inertia, or with a law that needs steps below a
  /// ten-thousandth of `step_s`.
  ModelDrive(const model::effects::DriveModel& model, double step_s, int substeps = 4);

  void step(double command_Nm) noexcept;

  /// As the encoder reports them.
  double position_rad() const noexcept {
    const double position_rad = parts_.motor_position_rad();
    return position_rad + effects_.encoder_error(position_rad).value_rad;
  }
  double velocity_rad_per_s() const noexcept {
    return (1 + effects_.encoder_error(parts_.motor_position_rad()).slope) *
           parts_.motor_velocity_rad_per_s();
  }
  double delivered_Nm() const noexcept { return delivered_Nm_; }
  double reported_Nm() const noexcept { return effects_.report_Nm(delivered_Nm_); }
  /// Commands of the past, one for each step, the oldest first: what the actuator still delivers.
  void set_commanded(std::span<const double> commands_Nm) noexcept {
    for (const double command_Nm : commands_Nm) delivered_Nm_ = effects_.deliver(command_Nm, step_s_);
  }
  /// Of the motor itself, behind the encoder.
  void set_position(double position_rad) noexcept { parts_.set_position(position_rad); }
  void set_velocity(double velocity_rad_per_s) noexcept { parts_.set_velocity(velocity_rad_per_s); }
  void set_load(double position_rad, double velocity_rad_per_s) noexcept {
    parts_.set_load(position_rad, velocity_rad_per_s);
  }  ///< behind a gap or a spring
  /// Of the friction contact.
  void set_deflection(double deflection_rad) noexcept { parts_.set_deflection(deflection_rad); }
  /// Of the friction laws with memory; one each, in the order of the effects.
  void set_laws(std::span<const model::friction::State> states) noexcept { parts_.set_laws(states); }
  void set_running(double running_s) noexcept {
    parts_.set_running(running_s);
  }  ///< for how long it has moved
  /// Time since the velocity changed sign.
  void set_since_reversal(double since_reversal_s) noexcept { parts_.set_since_reversal(since_reversal_s); }

 private:
  double step_s_;
  int substeps_;
  model::effects::EffectChain effects_;
  MovingParts parts_;
  double delivered_Nm_ = 0;
};

}  // namespace sim
