/// @file
/// The drive behind the hidden data: independent of sim/ and without shared code, so that finding an effect
/// in it does not just invert one's own formula.
///
/// A voltage-fed motor with a PI current loop turns a motor mass; a gear (nearly rigid by default) turns a
/// load mass; each has an elasto-plastic friction contact. All joint side and SI. 40 µs steps: leapfrog for
/// the masses, exact exponentials for current and contact.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string_view>
#include <vector>

#include "tests/gap/chance.h"

namespace gap_test {

inline constexpr double kPi = std::numbers::pi;

/// What can be hidden in the data. Up to kLoadFriction the effect library has a name for it.
enum class Hidden : std::uint8_t {
  kStribeck,
  kDirectionAsymmetry,
  kMidspeedDip,
  kQuadraticDrag,
  kPresliding,
  kCogging,
  kImbalance,
  kInertia,
  kBacklash,
  kElasticity,
  kThermalDrift,
  kTorqueOffset,
  kTorqueDeadband,
  kTransportDelay,
  kUnsignedCurrent,
  kLoadFriction,
  kPush,           ///< an occasional short push on the wheel
  kCyclicLoad,     ///< at a fixed frequency in time, independent of position
  kLooseCoupling,  ///< the load slips on its shaft above a torque
  kStickingBrush,  ///< brakes at random for a moment
  kRandomWalk,     ///< a disturbance torque that wanders
};
inline constexpr std::size_t kHiddenKinds = 21;
inline constexpr std::size_t kLibraryKinds = 16;
/// The library's name, or one of ours for causes outside the library.
std::string_view name_of(Hidden kind);

/// Known parameters of the drive.
struct Plant {
  double inertia_kg_m2 = 0.0112;
  double coulomb_Nm = 0.045;
  double viscous_Nm_s_per_rad = 0.0125;
  double load_share = 0.35;           ///< of the inertia, behind the gear
  double load_friction_share = 0.25;  ///< of the friction, behind the gear
  double gear_Hz = 300;               ///< resonance of motor and load mass on the gear
  double contact_Hz = 400;            ///< of a mass on its friction contact: far below an encoder tick
  double current_loop_Hz = 1000;
};

/// Amounts of the effects missing in the model; 0 means none. The numbers after an amount are its shape.
struct HiddenEffects {
  double stribeck_Nm = 0;  ///< above Coulomb at rest, over 1 + (v/vs)²
  double stribeck_rad_per_s = 0.3;
  double asymmetry_Nm = 0;
  double dip_Nm = 0;  ///< a raised cosine
  double dip_centre_rad_per_s = 2.5;
  double dip_half_width_rad_per_s = 1.5;
  double drag_Nm_s2_per_rad2 = 0;
  double contact_rad_per_Nm = 0;  ///< compliance of the friction contact
  double cogging_Nm = 0;          ///< and 0.3 of it at twice the frequency
  double cogging_per_rev = 26;
  double cogging_phase_rad = 0;
  double imbalance_Nm = 0;
  double imbalance_rest_rad = 0;
  double inertia_kg_m2 = 0;
  double gap_rad = 0;
  double shaft_rad_per_Nm = 0;
  double coupling_per_Nm = 0;  ///< one over the torque at which it slips
  double load_share = 0.4;     ///< of the inertia, behind gap, shaft or coupling
  double warm_share = 0;       ///< by which all friction changes once warm
  double warm_time_s = 10;
  double offset_Nm = 0;
  double deadband_Nm = 0;
  double delay_s = 0;
  double command_lag_s = 0;     ///< of a first-order filter of the command; not a kind of its own here
  double unsigned_current = 0;  ///< 1: the sensor has lost the sign
  double load_friction = 0;     ///< share of the load that becomes friction
  double push_Nm = 0;
  double cyclic_Nm = 0;
  double cyclic_Hz = 3;
  double brush_Nm = 0;
  double walk_Nm = 0;  ///< rms

  double& amount(Hidden kind);
  double amount(Hidden kind) const {
    HiddenEffects copy = *this;
    return copy.amount(kind);
  }
};

struct Sensors {
  double encoder_ticks_per_rev = 104000;
  double torque_noise_Nm = 0.0015;
  double noise_correlation_s = 0;  ///< 0: white; first-order coloured otherwise, same rms
  double torque_step_Nm = 0;       ///< resolution of the torque signal
  double torque_lag_s = 0;         ///< of a first-order filter in front of it
  /// rms of everything that the torque sensor adds: the unit of sizes.
  double noise_floor_Nm() const;
};

class HiddenPlant {
 public:
  static constexpr double kSample_s = 1e-3;
  static constexpr int kSubsteps = 25;
  /// Sampling time: half a period after the command plus the lag of the current loop. A staircase of commands
  /// sampled then is neither early nor late relative to its motion.
  static constexpr int kSensedSubstep = 16;

  /// `running_s`: time since the cold start.
  HiddenPlant(const Plant& plant, const HiddenEffects& effects, const Sensors& sensors, std::uint64_t seed,
              double running_s = 0);

  /// One sample period under a torque command.
  void step(double command_Nm);

  double measured_position_rad() const { return measured_position_rad_; }
  double measured_torque_Nm() const { return measured_torque_Nm_; }
  /// Torque of each effect in the last sample.
  const std::array<double, kHiddenKinds>& contributions_Nm() const { return contributions_Nm_; }

  // True values, for tests of the plant itself.
  double torque_Nm() const { return sensed_torque_Nm_; }  ///< at the sampling time
  double position_rad() const { return motor_.position_rad; }
  double velocity_rad_per_s() const { return motor_.velocity_rad_per_s; }
  double kinetic_J() const;
  double motor_work_J() const { return motor_work_J_; }
  double friction_heat_J() const { return friction_heat_J_; }

 private:
  struct Mass {
    double inertia_kg_m2;
    double friction_share;
    double contact_Nm_per_rad;
    double contact_Nm_s_per_rad;
    double position_rad = 0;
    double velocity_rad_per_s = 0;
    double acceleration_rad_per_s2 = 0;
    double deflection_rad = 0;
    double friction_Nm = 0;  // of the contact, drag not included
  };
  /// Friction of the whole drive while it slides, part by part.
  struct Level {
    double known_Nm;
    double stribeck_Nm;
    double asymmetry_Nm;
    double dip_Nm;
    double load_Nm;
    double brush_Nm;
    double sum_Nm() const { return known_Nm + stribeck_Nm + asymmetry_Nm + dip_Nm + load_Nm + brush_Nm; }
  };
  Level level(double velocity_rad_per_s, double direction) const;  // before the drive has warmed up
  double slide_level_Nm(const Mass& mass) const;
  void rub(Mass& mass);
  double drag_Nm(double velocity_rad_per_s) const;
  double delivered_command_Nm(double at_s) const;
  void drive_current(double command_Nm);
  double shaft_Nm();
  double cogging_Nm(double position_rad) const;
  double load_Nm(double position_rad) const;
  void disturb();
  void substep(double command_Nm);
  void measure();
  void account(double command_Nm, double missing_shaft_Nm, double delivered_Nm);

  Plant plant_;
  HiddenEffects effects_;
  Sensors sensors_;
  Chance disturbance_chance_;
  Chance noise_chance_;

  Mass motor_{};
  Mass load_{};
  double shaft_Nm_per_rad_ = 0;
  double shaft_Nm_s_per_rad_ = 0;
  double slipped_rad_ = 0;
  double transmitted_Nm_ = 0;

  double current_A_ = 0;
  double integral_V_ = 0;
  double current_decay_ = 0;
  double lag_gain_ = 1;

  std::vector<double> commands_Nm_;
  double time_s_ = 0;
  double running_s_ = 0;
  double warmth_ = 1;
  double outside_Nm_ = 0;  // against positive motion, on the load
  double brush_Nm_ = 0;
  double walk_Nm_ = 0;
  double event_until_s_ = 0;
  double event_from_s_ = 0;
  double event_Nm_ = 0;
  double next_event_s_ = 0;
  double cyclic_phase_rad_ = 0;

  double torque_Nm_ = 0;
  double sensed_torque_Nm_ = 0;
  double lagged_torque_Nm_ = 0;
  double command_gain_;
  double filtered_command_Nm_ = 0;
  double noise_Nm_ = 0;
  double measured_position_rad_ = 0;
  double measured_torque_Nm_ = 0;
  std::array<double, 2> slow_shaft_Nm_{};
  double shadow_position_rad_ = 0;
  double shadow_deflection_rad_ = 0;
  std::array<double, kHiddenKinds> contributions_Nm_{};
  double motor_work_J_ = 0;
  double friction_heat_J_ = 0;
};

}  // namespace gap_test
