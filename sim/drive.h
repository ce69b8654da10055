/// @file
/// One geared, torque-controlled joint: motor controller, motor, gear, friction, sensors.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "hal/joint.h"
#include "model/effects/effect_chain.h"
#include "model/friction/sliding_table.h"
#include "sim/bounded_bristle.h"
#include "sim/joint_sensors.h"
#include "sim/motor.h"
#include "sim/moving_parts.h"

namespace sim {

/// Joint side except for the motor. Defaults: a youBot wheel.
struct DriveParameters {
  MotorParameters motor;
  double gear_ratio = 9405.0 / 364.0;
  /// Behind the gear. 1.61e-3 follows from the thesis' σ1 = 0.2·√(J·σ0) and matches the wheel alone; the
  /// reflected rotor adds 9.0e-3.
  double load_inertia_kg_m2 = 1.61e-3;
  /// Presliding, thesis 2.5.2: σ0 from torque ramps, σ1 = 0.2·√(J·σ0).
  BoundedBristle::Parameters presliding{250.0, 0.127};
  SensorParameters sensors;
  /// Further effects in this drive, in addition to its friction curve.
  std::vector<model::effects::AnyEffect> effects{};
  /// The motor controller's own loops, used by velocity and position commands.
  double velocity_gain_Nm_s_per_rad = 0.3;
  double velocity_integral_gain_Nm_per_rad = 3.0;
  double position_gain_per_s = 10.0;
  double position_speed_limit_rad_per_s = 5.0;
};

/// J·dω/dt = k_t·g·i − friction(ω, z) − load; see MovingParts. The fastest mechanical part is the stuck
/// wheel, √(σ0/J) ≈ 150 rad/s; the winding with its current loop is ten times faster and determines the step:
/// see the convergence test. One thread. Cycle: control(), step() and sense() neither allocate nor lock.
class Drive {
 public:
  /// `friction`: a measured curve; without one all friction is in the effects.
  Drive(const DriveParameters& parameters, std::optional<model::friction::SlidingTable> friction,
        std::uint64_t noise_seed);

  /// Starts a controller period of `interval_s`: closes the loop for `command` on the last sensor values.
  /// Unpowered: the bridge is open and the joint coasts.
  void control(const hal::JointCommand& command, bool powered, double interval_s) noexcept;

  /// Integrates one step against `load_Nm`, positive if it brakes positive motion.
  void step(double load_Nm, double step_s) noexcept;

  /// Ends a controller period of `interval_s`: reads the sensors.
  void sense(double interval_s) noexcept;
  hal::JointSample measured() const noexcept;

  /// True values, for tests, energy balances and the summary of a simulated run.
  double position_rad() const noexcept { return parts_.position_rad(); }
  double velocity_rad_per_s() const noexcept { return parts_.velocity_rad_per_s(); }
  double motor_torque_Nm() const noexcept { return motor_torque_Nm_; }  ///< at the joint, over the last step
  double friction_torque_Nm() const noexcept { return parts_.friction_torque_Nm(); }  ///< likewise
  double inertia_kg_m2() const noexcept { return parts_.inertia_kg_m2(); }
  double breakaway_Nm(double direction) const noexcept { return parts_.breakaway_Nm(direction); }
  double longest_step_s() const noexcept { return parts_.longest_step_s(); }  ///< stable for friction laws
  const Motor& motor() const noexcept { return motor_; }
  void set_velocity(double velocity_rad_per_s) noexcept { parts_.set_velocity(velocity_rad_per_s); }

 private:
  double target_torque_Nm(const hal::JointCommand& command, double interval_s) noexcept;

  DriveParameters parameters_;
  model::effects::EffectChain effects_;
  Motor motor_;
  MovingParts parts_;
  JointSensors sensors_;
  double Nm_per_A_;  // k_t·g
  bool powered_ = false;
  double target_current_A_ = 0.0;
  double velocity_integral_Nm_ = 0.0;
  double motor_torque_Nm_ = 0.0;
};

}  // namespace sim
