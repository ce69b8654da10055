/// @file
/// Linear least squares judged on blocks of data that it did not see.
#pragma once
#include <Eigen/Core>
#include <limits>
#include <span>
#include <vector>

namespace identification::gap {

struct Bounds {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

/// min ½·xᵀGx − pᵀx within bounds, nearly: directions without information stay near zero.
Eigen::VectorXd bounded_solution(const Eigen::MatrixXd& gram, const Eigen::VectorXd& product,
                                 std::span<const Bounds> bounds);

/// A fixed set of columns and blocks of rows; targets and subsets of columns may change. What costs time with
/// the number of rows is done once per set of columns and once per target. Const functions may run in several
/// threads.
class BlockRegression {
 public:
  /// `block` of each row, 0 to blocks − 1, contiguous; `folds`: how many parts the blocks are dealt to in
  /// turn. Keeps a reference to `columns`.
  BlockRegression(const Eigen::MatrixXd& columns, std::vector<int> block, int folds);

  /// What has to be known of a target.
  struct Target {
    std::vector<Eigen::VectorXd> product;  ///< columnsᵀ·target of each block
    std::vector<double> square;
    std::vector<Eigen::VectorXd> fold_product;
    std::vector<double> fold_square;
    Eigen::VectorXd total_product;
    double total_square = 0;
  };
  Target target(const Eigen::VectorXd& values) const;

  struct Fit {
    Eigen::VectorXd coefficients;     ///< of all rows, in the order of the columns asked for
    double held_out = 0;              ///< sum of squares, each fold predicted from the others
    std::vector<double> held_out_of;  ///< the same, by block
  };
  /// Coefficients stay within `bounds` (one per column). Columns that carry no information stay near zero.
  Fit fit(const Target& target, std::span<const Eigen::Index> columns, std::span<const Bounds> bounds) const;
  /// Only Fit::held_out, faster.
  double held_out(const Target& target, std::span<const Eigen::Index> columns,
                  std::span<const Bounds> bounds) const;

 private:
  const Eigen::MatrixXd* columns_;
  std::vector<int> block_;
  std::vector<Eigen::MatrixXd> gram_;  // of each block
  std::vector<Eigen::MatrixXd> fold_gram_;
  Eigen::MatrixXd total_gram_;
};

}  // namespace identification::gap
