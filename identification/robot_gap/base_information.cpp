#include "identification/robot_gap/base_information.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace identification::robot_gap {
namespace {

constexpr double kLeastVariance = 1e-18;
/// The longest window is taken whose information is less than the best's by no more than this logarithm.
constexpr double kAlmost = 0.3;

}  // namespace

DenseFit dense_fit_of(const Eigen::MatrixXd& slopes, const Eigen::VectorXd& residual) {
  DenseFit result;
  const Eigen::VectorXd by = slopes.completeOrthogonalDecomposition().solve(residual);
  const double free = std::max(1.0, static_cast<double>(residual.size() - slopes.cols()));
  result.left = residual - slopes * by;
  result.variance = std::max(kLeastVariance, result.left.squaredNorm() / free);
  return result;
}

double information_of(const Eigen::MatrixXd& slopes, const Eigen::VectorXd& residual,
                      Eigen::Index parameters) {
  const double variance = dense_fit_of(slopes, residual).variance;
  double sum = 0;
  double shown = 0;
  for (Eigen::Index k = 0; k < parameters; ++k) {
    const double squares = slopes.col(k).squaredNorm();
    if (!(squares > 0)) continue;
    sum += std::log(squares / variance);
    ++shown;
  }
  return shown > 0 ? sum / shown : 0;
}

double longest_informative_s(const std::vector<double>& information, const std::vector<double>& lengths_s) {
  const auto best = std::ranges::max_element(information);
  auto chosen = best;
  while (chosen + 1 != information.end() && *(chosen + 1) >= *best - kAlmost) ++chosen;
  return lengths_s[static_cast<std::size_t>(chosen - information.begin())];
}

}  // namespace identification::robot_gap
