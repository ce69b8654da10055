#include "sim/gap/regression.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstddef>

namespace sim::gap {
namespace {

/// Relative to the columns' own squares: decides nothing, keeps singular systems solvable.
constexpr double kRidge = 1e-8;

/// min ½·xᵀGx − pᵀx within bounds: the unbounded solution, the worst offender put on its bound, and again.
Eigen::VectorXd solve(const Eigen::MatrixXd& gram, const Eigen::VectorXd& product,
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
    // In units of each column's own length, so that the ridge means the same to all.
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

}  // namespace

BlockRegression::BlockRegression(const Eigen::MatrixXd& columns, std::vector<int> block, int folds)
    : columns_(&columns), block_(std::move(block)), folds_(folds) {
  const int blocks = block_.empty() ? 0 : 1 + *std::max_element(block_.begin(), block_.end());
  const Eigen::Index m = columns.cols();
  gram_.assign(static_cast<std::size_t>(blocks), Eigen::MatrixXd::Zero(m, m));
  fold_gram_.assign(static_cast<std::size_t>(folds), Eigen::MatrixXd::Zero(m, m));
  total_gram_ = Eigen::MatrixXd::Zero(m, m);
  for (int b = 0; b < blocks; ++b) {
    std::vector<Eigen::Index> rows;
    for (std::size_t i = 0; i < block_.size(); ++i)
      if (block_[i] == b) rows.push_back(static_cast<Eigen::Index>(i));
    const Eigen::MatrixXd part = columns(rows, Eigen::all);
    Eigen::MatrixXd& gram = gram_[static_cast<std::size_t>(b)];
    gram.noalias() = part.transpose() * part;
    fold_gram_[static_cast<std::size_t>(b % folds)] += gram;
    total_gram_ += gram;
  }
}

void BlockRegression::set_target(const Eigen::VectorXd& target) {
  const Eigen::Index m = columns_->cols();
  product_.assign(gram_.size(), Eigen::VectorXd::Zero(m));
  square_.assign(gram_.size(), 0);
  // Blocks are contiguous: one product each.
  std::size_t first = 0;
  while (first < block_.size()) {
    std::size_t last = first;
    while (last < block_.size() && block_[last] == block_[first]) ++last;
    const auto begin = static_cast<Eigen::Index>(first);
    const auto length = static_cast<Eigen::Index>(last - first);
    const auto b = static_cast<std::size_t>(block_[first]);
    product_[b].noalias() += columns_->middleRows(begin, length).transpose() * target.segment(begin, length);
    square_[b] += target.segment(begin, length).squaredNorm();
    first = last;
  }
  fold_product_.assign(static_cast<std::size_t>(folds_), Eigen::VectorXd::Zero(m));
  total_product_ = Eigen::VectorXd::Zero(m);
  total_square_ = 0;
  for (std::size_t b = 0; b < gram_.size(); ++b) {
    fold_product_[b % static_cast<std::size_t>(folds_)] += product_[b];
    total_product_ += product_[b];
    total_square_ += square_[b];
  }
}

BlockRegression::Fit BlockRegression::fit(std::span<const Eigen::Index> columns,
                                          std::span<const Bounds> bounds) const {
  const std::vector<Eigen::Index> chosen(columns.begin(), columns.end());
  const Eigen::MatrixXd gram = total_gram_(chosen, chosen);
  const Eigen::VectorXd product = total_product_(chosen);
  Fit result;
  result.coefficients = solve(gram, product, bounds);
  result.held_out_of.assign(gram_.size(), 0);
  for (int fold = 0; fold < folds_; ++fold) {
    const auto f = static_cast<std::size_t>(fold);
    const Eigen::MatrixXd own = fold_gram_[f](chosen, chosen);
    const Eigen::VectorXd x = solve(gram - own, product - fold_product_[f](chosen), bounds);
    for (std::size_t b = f; b < gram_.size(); b += static_cast<std::size_t>(folds_)) {
      const double misfit = square_[b] - 2 * x.dot(product_[b](chosen)) + x.dot(gram_[b](chosen, chosen) * x);
      result.held_out_of[b] = std::max(0.0, misfit);
      result.held_out += result.held_out_of[b];
    }
  }
  return result;
}

}  // namespace sim::gap
