/// @file
/// A geared servo under position control that lifts a pendulum: its simulation, and its parameters from that.
///
/// An unloaded wheel cannot show friction that grows with the load on its gear; a joint that carries weight
/// does. [G. Duclusaud, G. Passault, V. Padois, O. Ly, "Extended Friction Models for the Physics Simulation
/// of Servo Actuators", ICRA 2025, arXiv 2410.08650]
#pragma once
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "identification/fit/statistics.h"
#include "identification/recording.h"

namespace identification::fit {

/// One recording. Columns: time_s, position_command_rad, position_rad (0 hangs straight down) and, unless the
/// drive was on throughout, drive_enabled: 1, or 0 while the motor's leads are open.
struct PendulumRun {
  Recording recording;
  double duty_per_rad = 0;  ///< gain of the position controller: share of the supply per rad of error
};

/// What is known beforehand. SI, joint side.
struct PendulumRig {
  double mass_kg = 0;  ///< of a point mass
  double length_m = 0;
  double gravity_m_per_s2 = 9.80665;
  double supply_V = 0;  ///< a constant, so that a simulation needs nothing measured but the start
  /// Of motor and driver. 0: fitted, as far as saturation and free swings tell it from viscous friction.
  double resistance_ohm = 0;
};

/// With q̇ = v,  m motor, e external, and T the torque that rotor and load would exchange without friction:
///
///   u  = clamp(gain·(command − q), −1, 1)                   duty
///   τm = (kt/R)·(u·V − kt·v),  0 while disabled             τe = −m·g·l·sin q
///   Jl = m·l²                                               T  = (Jl·τm − Ja·τe)/(Jl + Ja)
///   (Jl + Ja)·dv/dt = τm + τe − σ2·v − sgn(v)·F,            F  = Fc + (Fs − Fc)·exp(−|v/vs|^δ) + c·|T| +
///   c2·T²
///
/// and at v = 0 whatever holds the joint, up to F.
struct PendulumParameters {
  double torque_constant_Nm_per_A = 0.3;   ///< kt
  double resistance_ohm = 3;               ///< R
  double armature_kg_m2 = 2e-3;            ///< Ja, the rotor seen from the joint
  double coulomb_Nm = 0.02;                ///< Fc
  double viscous_Nm_s_per_rad = 0.01;      ///< σ2
  double load_share = 0;                   ///< c: what of the transmitted torque the gear eats
  double load_share_per_Nm = 0;            ///< c2: how that share grows with it
  double static_Nm = 0.02;                 ///< Fs, not below Fc
  double stribeck_velocity_rad_per_s = 1;  ///< vs
  double stribeck_exponent = 1;            ///< δ, never fitted
};

/// How the joint moves by itself from the first measured position, at rest: rad, one value a row. The command
/// is interpolated between rows.
/// `longest_step_s`: of the integration, whose error goes with its square.
/// @throws std::invalid_argument for a missing column, fewer than two rows, time that does not rise, a gain,
/// a rig, a step or an inertia that is not positive and finite.
std::vector<double> simulate_pendulum(const PendulumRun& run, const PendulumRig& rig,
                                      const PendulumParameters& parameters, double longest_step_s = 1e-3);

/// What friction is made of besides Coulomb's and viscous.
struct PendulumFriction {
  bool load = false;            ///< c
  bool load_quadratic = false;  ///< c2
  bool stribeck = false;        ///< Fs, vs
};

struct PendulumFitOptions {
  PendulumFriction friction{};
  double longest_step_s = 6e-3;    ///< as of simulate_pendulum()
  std::size_t rows_per_run = 250;  ///< compared, evenly over each run, so that all runs count alike
  /// Errors beyond this count by magnitude (Huber): a stick that is let go one command earlier or later moves
  /// a whole stretch, and must not outvote the rest.
  double outlier_rad = 0.03;
};

struct PendulumFit {
  PendulumParameters parameters;
  /// Of what was fitted, named as in PendulumParameters. Intervals take each run for one observation, and are
  /// infinite unless there are more runs than parameters.
  std::vector<Estimate> estimates;
  double mean_absolute_error_rad = 0;  ///< over the runs fitted
  bool converged = false;

  /// @throws std::invalid_argument when there is no such parameter
  const Estimate& estimate(std::string_view name) const;
};

/// Free simulation of every run, fitted to position_rad. Richer friction starts from the fit of plainer one,
/// so that it does not end in a worse minimum.
/// @throws std::invalid_argument as simulate_pendulum(), and when there is no run, one has fewer rows than
/// are compared, or the outlier bound is not positive.
PendulumFit fit_pendulum(std::span<const PendulumRun> runs, const PendulumRig& rig,
                         const PendulumFitOptions& options = {});

/// Mean over the runs of the mean |simulated − measured position|, at all rows.
/// @throws std::invalid_argument as simulate_pendulum(), and when there is no run.
double pendulum_error_rad(std::span<const PendulumRun> runs, const PendulumRig& rig,
                          const PendulumParameters& parameters, double longest_step_s = 1e-3);

}  // namespace identification::fit
