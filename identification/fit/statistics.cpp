#include "identification/fit/statistics.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace identification::fit {

const Estimate* find_estimate(std::span<const Estimate> estimates, std::string_view effect,
                              std::string_view name) {
  const auto found = std::ranges::find_if(
      estimates, [&](const Estimate& e) { return e.effect == effect && e.name == name; });
  return found == estimates.end() ? nullptr : &*found;
}

const Estimate& estimate_of(std::span<const Estimate> estimates, std::string_view effect,
                            std::string_view name) {
  if (const Estimate* const found = find_estimate(estimates, effect, name)) return *found;
  throw std::invalid_argument("the fit has no parameter " + std::string(effect) + " " + std::string(name));
}

double normal_quantile(double p) {
  // Bisection on the distribution itself: not used in inner loops.
  double below = -40;
  double above = 40;
  while (above - below > 1e-10) {
    const double middle = 0.5 * (below + above);
    (0.5 * std::erfc(-middle / std::sqrt(2.0)) < p ? below : above) = middle;
  }
  return 0.5 * (below + above);
}

double student_quantile(double p, double degrees_of_freedom) {
  const double n = degrees_of_freedom;
  const double z = normal_quantile(p);
  const double z3 = z * z * z;
  const double z5 = z3 * z * z;
  const double z7 = z5 * z * z;
  const double z9 = z7 * z * z;
  return z + (z3 + z) / (4 * n) + (5 * z5 + 16 * z3 + 3 * z) / (96 * n * n) +
         (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * n * n * n) +
         (79 * z9 + 776 * z7 + 1482 * z5 - 1920 * z3 - 945 * z) / (92160 * n * n * n * n);
}

double student_975(double degrees_of_freedom) {
  if (degrees_of_freedom <= 1) return 12.7062;
  if (degrees_of_freedom <= 2) return 4.30265;
  return student_quantile(0.975, degrees_of_freedom);
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

double robust_sigma(std::vector<double> deviations) {
  for (double& deviation : deviations) deviation = std::abs(deviation);
  return 1.482602218505602 * median(std::move(deviations));
}

MeanOf mean_of(std::span<const double> values) {
  double count = 0.0;
  double mean = 0.0;
  double squares = 0.0;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    const double off = value - mean;
    mean += off / ++count;
    squares += off * (value - mean);
  }
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (count < 1) return {kNone, kNone, 0};
  if (count < 2) return {mean, kNone, count};
  return {mean, student_975(count - 1) * std::sqrt(squares / (count - 1) / count), count};
}

double relative_error_percent(const Eigen::VectorXd& measured, const Eigen::VectorXd& predicted) {
  const double error = (measured - predicted).norm();
  return error == 0 ? 0 : 100 * error / measured.norm();
}

double r_squared(const Eigen::VectorXd& measured, const Eigen::VectorXd& predicted) {
  return 1 -
         (measured - predicted).squaredNorm() / (measured.array() - measured.mean()).matrix().squaredNorm();
}

namespace {

using SquareSvd = Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::NoQRPreconditioner>;

/// Singular values and V of a matrix, from R of its QR decomposition, which has the same.
SquareSvd svd_of(const Eigen::MatrixXd& matrix) {
  const Eigen::MatrixXd qr = Eigen::HouseholderQR<Eigen::MatrixXd>(matrix).matrixQR();
  const Eigen::Index rows = std::min(matrix.rows(), matrix.cols());
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(matrix.cols(), matrix.cols());
  R.topRows(rows) = qr.topRows(rows).triangularView<Eigen::Upper>();
  return SquareSvd(R, Eigen::ComputeFullV);
}

}  // namespace

Eigen::MatrixXd normal_inverse(const Eigen::MatrixXd& jacobian) {
  if (jacobian.cols() == 0) return {};
  Eigen::VectorXd length = jacobian.colwise().norm();
  for (double& l : length)
    if (!(l > 0)) l = 1e-150;
  const Eigen::MatrixXd scaled = jacobian * length.cwiseInverse().asDiagonal();
  const SquareSvd svd = svd_of(scaled);
  Eigen::VectorXd inverse_square = svd.singularValues();
  const double least = 1e-9 * (inverse_square.size() > 0 ? inverse_square[0] : 1);
  for (double& s : inverse_square) s = 1 / std::max(s * s, least * least);
  const Eigen::MatrixXd V = length.cwiseInverse().asDiagonal() * svd.matrixV();
  return V * inverse_square.asDiagonal() * V.transpose();
}

double condition_number(const Eigen::MatrixXd& jacobian) {
  if (jacobian.cols() == 0) return 1;
  const Eigen::VectorXd length = jacobian.colwise().norm();
  if (!(length.minCoeff() > 0) || jacobian.rows() < jacobian.cols())
    return std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd scaled = jacobian * length.cwiseInverse().asDiagonal();
  const Eigen::VectorXd s = svd_of(scaled).singularValues();
  return s[0] / s[s.size() - 1];
}

Eigen::MatrixXd block_covariance(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                                 std::size_t blocks) {
  const auto rows = static_cast<std::size_t>(jacobian.rows());
  std::vector<std::size_t> block(rows);
  for (std::size_t b = 0; b < blocks; ++b)
    for (std::size_t i = b * rows / blocks; i < (b + 1) * rows / blocks; ++i) block[i] = b;
  return group_covariance(jacobian, residuals, block, blocks);
}

Eigen::MatrixXd group_covariance(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                                 const std::vector<std::size_t>& group, std::size_t groups) {
  const Eigen::Index p = jacobian.cols();
  Eigen::MatrixXd scores = Eigen::MatrixXd::Zero(p, static_cast<Eigen::Index>(groups));
  for (Eigen::Index i = 0; i < jacobian.rows(); ++i)
    scores.col(static_cast<Eigen::Index>(group[static_cast<std::size_t>(i)])) +=
        residuals[i] * jacobian.row(i).transpose();
  const Eigen::MatrixXd bread = normal_inverse(jacobian);
  const auto count = static_cast<double>(groups);
  return bread * (scores * scores.transpose()) * bread * count /
         std::max(1.0, count - static_cast<double>(p));
}

}  // namespace identification::fit
