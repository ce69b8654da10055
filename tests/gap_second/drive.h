/// @file
/// The true drive, for recordings that judge youbot-gap. It shares nothing with the library: other friction
/// laws, another integration, another actuator. SI units, joint side.
///
/// Motor and load are one mass, or two with a spring or free play between them. Friction is set-valued
/// Coulomb friction by time stepping after Moreau (sticking is exact rest) or, with presliding, the
/// elasto-plastic bristle of Dupont, Hayward, Armstrong and Altpeter (IEEE TAC 47, 2002). Flanks collide
/// according to Hunt and Crossley (1975).
#pragma once
#include <cstdint>
#include <random>
#include <vector>

namespace gap_second {

constexpr double kStepS = 5e-5;  ///< of the integration, 20 kHz

/// Zero means that the drive does not have this property.
struct DriveTruth {
  double inertia_kg_m2 = 0.01;  ///< motor and load together
  double coulomb_Nm = 0.0;
  double viscous_Nm_s_per_rad = 0.0;

  // Friction
  double static_excess_Nm = 0.0;  ///< static minus sliding friction
  double stribeck_rad_per_s = 1.0;
  double asymmetry_coulomb_Nm = 0.0;  ///< more of it forward, less of it backward
  double asymmetry_viscous_Nm_s_per_rad = 0.0;
  double dip_depth_Nm = 0.0;
  double dip_centre_rad_per_s = 1.0;
  double dip_width_rad_per_s = 1.0;
  double drag_Nm_s2_per_rad2 = 0.0;
  double load_friction_share = 0.0;  ///< of what weighs on the joint
  double bristle_stiffness_Nm_per_rad = 0.0;
  double drift_coulomb_Nm = 0.0;
  double drift_time_constant_s = 1.0;

  // Torque over position, or always
  double cogging_Nm = 0.0;
  double cogging_per_rev = 1.0;
  double cogging_phase_rad = 0.0;
  double imbalance_Nm = 0.0;
  double rest_position_rad = 0.0;
  double offset_Nm = 0.0;  ///< against positive motion

  // Between motor and load
  double load_share = 0.0;  ///< of the inertia; 0: one mass
  double coupling_stiffness_Nm_per_rad = 0.0;
  double coupling_damping_Nm_s_per_rad = 0.0;
  double gap_rad = 0.0;                 ///< from flank to flank
  double impact_loss_s_per_rad = 0.0;   ///< Hunt and Crossley's damping over stiffness
  double friction_share_of_load = 0.1;  ///< only with two masses

  // Actuator
  double largest_torque_Nm = 1e9;
  double current_lag_s = 0.0;
  double delay_s = 0.0;
  double deadband_Nm = 0.0;

  // Causes outside any library of effects
  double rough_track_share = 0.0;  ///< of Coulomb friction, changes along the way and never repeats
  double hidden_lag_s = 0.0;       ///< between measured and acting torque
  double soft_limit_Nm = 0.0;      ///< acting torque saturates towards it, invisible in the measured one
  double transmitted_share = 0.0;  ///< friction as a share of the motor's torque
  double brake_Nm = 0.0;           ///< drags and lets go at random instants
  double hum_Nm = 0.0;             ///< from outside, at a frequency and not over position
  double hum_Hz = 1.0;
};

struct DriveState {
  double motor_rad = 0.0;
  double motor_rad_per_s = 0.0;
  double load_rad = 0.0;
  double load_rad_per_s = 0.0;
  double bristle_rad = 0.0;
};

class Drive {
 public:
  /// @throws std::invalid_argument for a non-positive inertia, or a coupling too stiff for the step.
  Drive(const DriveTruth& truth, std::uint64_t seed);
  /// Lasts kStepS.
  void step(double command_Nm);
  const DriveState& state() const { return state_; }
  /// Torque of the motor's current, as measured by a current sensor.
  double motor_torque_Nm() const { return motor_torque_Nm_; }
  double time_s() const { return time_s_; }
  /// Kinetic energy and that of the spring.
  double energy_J() const;
  /// From motor to load.
  double coupling_torque_Nm() const;

 private:
  double delivered(double command_Nm);
  double sliding_friction(double velocity_rad_per_s, double direction) const;
  double weight_Nm(double position_rad) const;
  double bristle_torque(double velocity_rad_per_s);
  void move(double& velocity_rad_per_s, double torque_Nm, double inertia_kg_m2, double friction_share);

  DriveTruth truth_;
  DriveState state_;
  double time_s_ = 0.0;
  double motor_torque_Nm_ = 0.0;
  double acting_torque_Nm_ = 0.0;
  bool brake_drags_ = false;
  double brake_changes_at_s_ = 0.0;
  std::vector<double> commands_under_way_;
  std::size_t next_command_ = 0;
  std::mt19937_64 random_;
};

}  // namespace gap_second
