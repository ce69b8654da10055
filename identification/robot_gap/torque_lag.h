/// @file
/// The lag of recorded torques behind the motion, and whether the data determine it.
#pragma once
#include <functional>
#include <vector>

namespace identification::robot_gap {

/// Squared residuals with the torques of one lag, summed over each of several stretches of time.
struct LeftByLag {
  std::vector<double> by_all;    ///< after a fit of all parameters
  std::vector<double> by_given;  ///< of the given model
};

struct TorqueLag {
  double lag_s = 0;           ///< of the torques behind the motion
  bool is_determined = true;  ///< lags 10 ms shorter and longer leave significantly more after a fit
  /// Range of the lags that the data do not refute, to the step of the search.
  double shortest_s = 0;
  double longest_s = 0;
};

/// Finds the lag within ± `longest_s` that leaves the least squares after a fit of all parameters. If the
/// data do not determine it, the lag is the one in their range with which the given model leaves least: under
/// one sine, for example, every lag is a change of mass and friction. In both cases zero is taken unless it
/// leaves significantly more. `left_at`: of a lag [s]; several threads call it.
TorqueLag torque_lag(const std::function<LeftByLag(double)>& left_at, double longest_s);

}  // namespace identification::robot_gap
