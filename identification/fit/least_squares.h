/// @file
/// Nonlinear least squares with bounds, several starts and a robust loss, common to all fits here.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

namespace identification::fit {

/// min over lower <= p <= upper of  ½·Σ ρ(r_i(p)²). Residuals are in units of their standard deviation.
struct LeastSquaresProblem {
  std::size_t residuals = 0;
  Eigen::VectorXd lower;
  Eigen::VectorXd upper;
  /// Significant change of a parameter; used for the numeric derivatives.
  Eigen::VectorXd scale;
  /// Only called within the bounds.
  std::function<void(const Eigen::VectorXd& parameters, Eigen::VectorXd& residuals)> evaluate;
  /// Huber's ρ beyond this many standard deviations; 0: squares everywhere.
  double huber = 0;
  int max_iterations = 100;
  double tolerance = 1e-12;  ///< converged when a step changes the sum by less than this share
};

struct LeastSquaresSolution {
  Eigen::VectorXd parameters;
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;  ///< of the residuals, residuals × parameters; one-sided steps at a bound
  double cost = 0;           ///< ½·Σ ρ
  bool converged = false;
};

/// The best of the local minima from `starts` (each moved into the bounds). Deterministic, one thread. A
/// problem without parameters is only evaluated. @throws std::invalid_argument if there is no start.
LeastSquaresSolution minimise(const LeastSquaresProblem& problem, const std::vector<Eigen::VectorXd>& starts);

}  // namespace identification::fit
