/// @file
/// How much windows of one length say about the parameters of a base.
#pragma once
#include <Eigen/Core>
#include <vector>

namespace identification::robot_gap {

/// Residual of a model, and what all of its parameters together leave.
struct DenseFit {
  Eigen::VectorXd left;
  double variance = 0;
};
DenseFit dense_fit_of(const Eigen::MatrixXd& slopes, const Eigen::VectorXd& residual);

/// Mean over the first `parameters` columns of the logarithm of how often each is determined, by itself,
/// against what all columns together leave.
double information_of(const Eigen::MatrixXd& slopes, const Eigen::VectorXd& residual,
                      Eigen::Index parameters);

/// Each so many times the one before.
inline constexpr double kLongerWindow = 1.25;

/// The longest window that is almost as informative as the best. Noise of the sensors is in each window once,
/// while what a wrong parameter does adds up: long windows see more, up to where it cancels or the windows
/// are too few. Of those that see as much, in the longest most of the disagreement is not noise.
double longest_informative_s(const std::vector<double>& information, const std::vector<double>& lengths_s);

}  // namespace identification::robot_gap
