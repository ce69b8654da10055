/// @file
/// Handle velocity from its positions.
#pragma once
#include <Eigen/Core>
#include <chrono>

namespace hal {

/// Backward difference through a first-order low pass: v += (1 - exp(-2 pi f_c dt)) (dp/dt - v). A constant
/// velocity is exact; during constant acceleration it lags by 1/(2 pi f_c): 4 ms at the default. A position
/// step of one encoder count q appears as 2 pi f_c q: 2.5 mm/s for the 0.01 mm of an omega.6. One thread.
/// Cycle: everything.
class VelocityFilter {
 public:
  explicit VelocityFilter(double cutoff_Hz = kDefaultCutoff_Hz) : cutoff_Hz_(cutoff_Hz) {}

  /// The velocity at `stamp`. A stamp not later than the previous one changes nothing.
  Eigen::Vector3d update(const Eigen::Vector3d& position_m, std::chrono::nanoseconds stamp) noexcept;
  /// The next position counts as the first one: its velocity is zero.
  void reset() noexcept { has_position_ = false; }

  static constexpr double kDefaultCutoff_Hz = 40.0;

 private:
  double cutoff_Hz_;
  bool has_position_ = false;
  Eigen::Vector3d position_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_m_per_s_ = Eigen::Vector3d::Zero();
  std::chrono::nanoseconds stamp_{};
};

}  // namespace hal
