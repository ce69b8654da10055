/// @file
/// Linear least squares judged on blocks of data that it did not see.
#pragma once
#include <Eigen/Core>
#include <limits>
#include <span>
#include <vector>

namespace sim::gap {

struct Bounds {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

/// A fixed set of columns and blocks of rows; targets and subsets of columns may change. What costs time with
/// the number of rows is done once per set of columns and once per target.
class BlockRegression {
 public:
  /// `block` of each row, 0 to blocks − 1; `folds`: how many parts the blocks are dealt to in turn.
  BlockRegression(const Eigen::MatrixXd& columns, std::vector<int> block, int folds);

  void set_target(const Eigen::VectorXd& target);

  struct Fit {
    Eigen::VectorXd coefficients;     ///< of all rows, in the order of the columns asked for
    double held_out = 0;              ///< sum of squares, each fold predicted from the others
    std::vector<double> held_out_of;  ///< the same, by block
  };
  /// Coefficients stay within `bounds` (one per column). Columns that carry no information stay near zero.
  Fit fit(std::span<const Eigen::Index> columns, std::span<const Bounds> bounds) const;

  int blocks() const noexcept { return static_cast<int>(gram_.size()); }
  double square() const noexcept { return total_square_; }  ///< of the target

 private:
  const Eigen::MatrixXd* columns_;
  std::vector<int> block_;
  int folds_;
  std::vector<Eigen::MatrixXd> gram_;     // of each block
  std::vector<Eigen::VectorXd> product_;  // columnsᵀ·target of each block
  std::vector<double> square_;
  Eigen::MatrixXd total_gram_;
  std::vector<Eigen::MatrixXd> fold_gram_;
  std::vector<Eigen::VectorXd> fold_product_;
  Eigen::VectorXd total_product_;
  double total_square_ = 0;
};

}  // namespace sim::gap
