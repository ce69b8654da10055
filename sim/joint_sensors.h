/// @file
/// Sensor values of a youBot motor controller for the true joint: quantised, differenced, noisy.
#pragma once
#include <cstdint>
#include <random>

namespace sim {

/// Joint side. Defaults: a wheel (4000 ticks and 25.838 motor turns per wheel turn, 1 rpm, 1 mA).
struct SensorParameters {
  double position_resolution_rad = 6.0795e-5;
  double velocity_resolution_rad_per_s = 4.0530e-3;
  double torque_resolution_Nm = 8.656e-4;
  /// 1 σ. The thesis calls the reported velocity "quite noisy and of low reliability"; in addition it is made
  /// from tick differences, so a single tick in 1 ms appears as 0.06 rad/s.
  double velocity_noise_rad_per_s = 0.03;
  double torque_noise_Nm = 0.0015;
};

class JointSensors {
 public:
  /// Equal seeds give equal noise.
  JointSensors(const SensorParameters& parameters, std::uint64_t seed)
      : parameters_(parameters), random_(seed) {}

  /// Samples the encoder and, over `interval_s` since the last call, the velocity. Once per controller
  /// period.
  void update(double position_rad, double torque_Nm, double interval_s) noexcept;

  double position_rad() const noexcept { return position_rad_; }
  double velocity_rad_per_s() const noexcept { return velocity_rad_per_s_; }
  double torque_Nm() const noexcept { return torque_Nm_; }

 private:
  SensorParameters parameters_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double position_rad_ = 0.0;
  double velocity_rad_per_s_ = 0.0;
  double torque_Nm_ = 0.0;
};

}  // namespace sim
