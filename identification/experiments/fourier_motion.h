/// @file
/// Periodic motion of several joints as finite Fourier series, from rest to rest.
#pragma once
#include <Eigen/Core>

namespace identification::experiments {

/// Of each joint.
struct MotionLimits {
  Eigen::VectorXd lower_rad;
  Eigen::VectorXd upper_rad;
  Eigen::VectorXd speed_rad_per_s;
  Eigen::VectorXd acceleration_rad_per_s2;
};

/// q(t) = centre + w(t)·Σ_k sine_k·sin(k·ω·t) + cosine_k·cos(k·ω·t),   ω = 2π/period
///
/// Position, velocity and acceleration are known in closed form, and the signal repeats, so that noise
/// averages out. [J. Swevers et al., "Optimal robot excitation and identification", IEEE Trans. Robotics and
/// Automation 13(5), 1997] The window w rises from 0 to 1 within `ramp_s`, with continuous acceleration, and
/// falls again at the end: the motion starts and ends at rest at its centre.
struct FourierMotion {
  double period_s = 10;
  double duration_s = 20;
  double ramp_s = 2;
  Eigen::VectorXd centre_rad{};
  Eigen::MatrixXd sine_rad{};  ///< joints × harmonics
  Eigen::MatrixXd cosine_rad{};

  Eigen::Index joints() const noexcept { return centre_rad.size(); }
  struct State {
    double position_rad = 0;
    double velocity_rad_per_s = 0;
    double acceleration_rad_per_s2 = 0;
  };
  /// Cycle. Before the start and after the end the joint rests at its centre.
  State at(Eigen::Index joint, double time_s) const noexcept;
};

/// The motion with the coefficients of each joint scaled until the first of its limits is reached. A joint
/// whose centre is beyond a limit, or without coefficients, rests.
FourierMotion filling(FourierMotion motion, const MotionLimits& limits);

}  // namespace identification::experiments
