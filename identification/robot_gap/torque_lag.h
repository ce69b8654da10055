/// @file
/// The lag of recorded torques behind the motion, and whether the data determine it.
#pragma once
#include <functional>
#include <vector>

namespace identification::robot_gap {

/// Squares of the residuals with the torques of one lag, of each of several stretches of time.
struct LeftByLag {
  std::vector<double> by_all;    ///< what all parameters together leave
  std::vector<double> by_given;  ///< what the given model leaves
};

struct TorqueLag {
  double lag_s = 0;
  bool is_determined = true;
  /// Lags that the data do not refute, to the step of the search.
  double shortest_s = 0;
  double longest_s = 0;
};

/// The lag with which all parameters together explain most, within ± `longest_s`. It is determined if lags
/// 10 ms shorter and longer both leave significantly more. A lag of zero that does not leave significantly
/// more is preferred. Under one sine, for example, every lag is a change of mass and friction: of all lags
/// that the data allow it is then the one that asks for the smallest change of the given model. `left_at`:
/// [s]; called by several threads.
TorqueLag torque_lag(const std::function<LeftByLag(double)>& left_at, double longest_s);

}  // namespace identification::robot_gap
