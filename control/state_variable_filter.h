/// @file
/// Velocity and acceleration from position, without differencing encoder ticks (thesis 2.7.2, figure 30).
#pragma once
#include <Eigen/Core>
#include <optional>

namespace control {

/// Second-order low-pass x/u = ω²/(s² + 2ζωs + ω²) whose states are the filtered position and its derivative,
/// discretised exactly for an input that is linear between samples: the slope of a ramp is exact, and the
/// filtered position lags by 2ζ/ω.
/// Cycle: reset(), step().
class StateVariableFilter {
 public:
  struct Config {
    double cutoff_rad_per_s = 125.0;  ///< ω, about 20 Hz: one encoder tick then shows as 3 mrad/s
    double damping = 0.9;             ///< ζ, 0.1 to 10
    double period_s = 1e-3;
  };
  struct Output {
    double position = 0.0;
    double velocity = 0.0;
    double acceleration = 0.0;
  };

  /// @throws std::invalid_argument naming the value that is not finite or out of range, also if the cut-off
  /// is too high for the period (ω·T above 1).
  explicit StateVariableFilter(const Config& config);

  /// At rest at `position`: a start far from zero causes no false velocity.
  void reset(double position) noexcept {
    state_ = {position, 0.0};
    last_input_ = position;
    started_ = true;
  }
  /// The first step after construction resets to its input. Input and output have the same unit. `elapsed_s`:
  /// time since the last input; empty: one period; 0: the last input repeated, the estimate is unchanged.
  Output step(double position, std::optional<double> elapsed_s = {}) noexcept;

 private:
  Eigen::Matrix2d transition_over(double time_s) const noexcept;  // Φ
  void follow(double position, double elapsed_s) noexcept;

  double period_s_;
  double lag_s_;                // 2ζ/ω
  double stiffness_;            // ω²
  double friction_;             // 2ζω
  Eigen::Matrix2d transition_;  // over a period
  Eigen::Vector2d state_ = Eigen::Vector2d::Zero();
  double last_input_ = 0.0;
  bool started_ = false;
};

}  // namespace control
