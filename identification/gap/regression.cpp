#include "identification/gap/regression.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstddef>

namespace identification::gap {
namespace {

/// Relative to the columns' own squares: no effect on results, keeps singular systems solvable.
constexpr double kRidge = 1e-8;

}  // namespace

// Solves without bounds, fixes the worst violation at its bound, and repeats.
Eigen::VectorXd bounded_solution(const Eigen::MatrixXd& gram, const Eigen::VectorXd& product,
                                 std::span<const Bounds> bounds) {
  const Eigen::Index n = gram.rows();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  std::vector<bool> fixed(static_cast<std::size_t>(n), false);
  for (Eigen::Index round = 0; round <= n; ++round) {
    std::vector<Eigen::Index> free;
    for (Eigen::Index i = 0; i < n; ++i)
      if (!fixed[static_cast<std::size_t>(i)] && gram(i, i) > 0) free.push_back(i);
    if (free.empty()) break;
    Eigen::VectorXd held = x;
    for (const Eigen::Index i : free) held[i] = 0;
    Eigen::MatrixXd g = gram(free, free);
    Eigen::VectorXd p = (product - gram * held)(free);
    // In units of each column's length, so that the ridge is equal for all.
    const Eigen::VectorXd unit = g.diagonal().cwiseSqrt().cwiseInverse();
    g = unit.asDiagonal() * g * unit.asDiagonal();
    g.diagonal().array() += kRidge;
    p = unit.cwiseProduct(p);
    const Eigen::VectorXd step = unit.cwiseProduct(g.ldlt().solve(p));
    Eigen::Index worst = -1;
    double excess = 0;
    for (std::size_t k = 0; k < free.size(); ++k) {
      const auto at = static_cast<std::size_t>(free[k]);
      const double value = step[static_cast<Eigen::Index>(k)];
      x[free[k]] = value;
      const double beyond = std::max(bounds[at].lower - value, value - bounds[at].upper);
      const double scaled = beyond / unit[static_cast<Eigen::Index>(k)];
      if (beyond > 0 && scaled > excess) {
        excess = scaled;
        worst = free[k];
      }
    }
    if (worst < 0) break;
    const Bounds& bound = bounds[static_cast<std::size_t>(worst)];
    x[worst] = std::clamp(x[worst], bound.lower, bound.upper);
    fixed[static_cast<std::size_t>(worst)] = true;
  }
  return x;
}

BlockRegression::BlockRegression(const Eigen::MatrixXd& columns, std::vector<int> block, int folds)
    : columns_(&columns), block_(std::move(block)) {
  const int blocks = block_.empty() ? 0 : 1 + *std::max_element(block_.begin(), block_.end());
  const Eigen::Index m = columns.cols();
  gram_.assign(static_cast<std::size_t>(blocks), Eigen::MatrixXd::Zero(m, m));
  fold_gram_.assign(static_cast<std::size_t>(folds), Eigen::MatrixXd::Zero(m, m));
  total_gram_ = Eigen::MatrixXd::Zero(m, m);
  for (int b = 0; b < blocks; ++b) {
    const auto first = std::ranges::lower_bound(block_, b) - block_.begin();
    const auto last = std::ranges::upper_bound(block_, b) - block_.begin();
    const auto part = columns.middleRows(first, last - first);
    Eigen::MatrixXd& gram = gram_[static_cast<std::size_t>(b)];
    gram.noalias() = part.transpose() * part;
    fold_gram_[static_cast<std::size_t>(b % folds)] += gram;
    total_gram_ += gram;
  }
}

BlockRegression::Target BlockRegression::target(const Eigen::VectorXd& values) const {
  const Eigen::Index m = columns_->cols();
  Target result;
  result.product.assign(gram_.size(), Eigen::VectorXd::Zero(m));
  result.square.assign(gram_.size(), 0);
  result.fold_product.assign(fold_gram_.size(), Eigen::VectorXd::Zero(m));
  result.fold_square.assign(fold_gram_.size(), 0);
  result.total_product = Eigen::VectorXd::Zero(m);
  std::size_t first = 0;
  while (first < block_.size()) {
    std::size_t last = first;
    while (last < block_.size() && block_[last] == block_[first]) ++last;
    const auto begin = static_cast<Eigen::Index>(first);
    const auto length = static_cast<Eigen::Index>(last - first);
    const auto b = static_cast<std::size_t>(block_[first]);
    result.product[b].noalias() =
        columns_->middleRows(begin, length).transpose() * values.segment(begin, length);
    result.square[b] = values.segment(begin, length).squaredNorm();
    result.fold_product[b % fold_gram_.size()] += result.product[b];
    result.fold_square[b % fold_gram_.size()] += result.square[b];
    result.total_product += result.product[b];
    result.total_square += result.square[b];
    first = last;
  }
  return result;
}

BlockRegression::Fit BlockRegression::fit(const Target& target, std::span<const Eigen::Index> columns,
                                          std::span<const Bounds> bounds) const {
  const std::vector<Eigen::Index> chosen(columns.begin(), columns.end());
  const Eigen::MatrixXd gram = total_gram_(chosen, chosen);
  const Eigen::VectorXd product = target.total_product(chosen);
  Fit result;
  result.coefficients = bounded_solution(gram, product, bounds);
  result.held_out_of.assign(gram_.size(), 0);
  for (std::size_t f = 0; f < fold_gram_.size(); ++f) {
    const Eigen::MatrixXd own = fold_gram_[f](chosen, chosen);
    const Eigen::VectorXd x = bounded_solution(gram - own, product - target.fold_product[f](chosen), bounds);
    for (std::size_t b = f; b < gram_.size(); b += fold_gram_.size()) {
      const double misfit =
          target.square[b] - 2 * x.dot(target.product[b](chosen)) + x.dot(gram_[b](chosen, chosen) * x);
      result.held_out_of[b] = std::max(0.0, misfit);
      result.held_out += result.held_out_of[b];
    }
  }
  return result;
}

double BlockRegression::held_out(const Target& target, std::span<const Eigen::Index> columns,
                                 std::span<const Bounds> bounds) const {
  const std::vector<Eigen::Index> chosen(columns.begin(), columns.end());
  const Eigen::MatrixXd gram = total_gram_(chosen, chosen);
  const Eigen::VectorXd product = target.total_product(chosen);
  double sum = 0;
  for (std::size_t f = 0; f < fold_gram_.size(); ++f) {
    const Eigen::MatrixXd own = fold_gram_[f](chosen, chosen);
    const Eigen::VectorXd own_product = target.fold_product[f](chosen);
    const Eigen::VectorXd x = bounded_solution(gram - own, product - own_product, bounds);
    sum += std::max(0.0, target.fold_square[f] - 2 * x.dot(own_product) + x.dot(own * x));
  }
  return sum;
}

}  // namespace identification::gap
