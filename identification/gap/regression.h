/// @file
/// Linear least squares, judged on held-out blocks of data.
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

/// min ½·xᵀGx − pᵀx within bounds, approximately: directions without information stay near zero.
Eigen::VectorXd bounded_solution(const Eigen::MatrixXd& gram, const Eigen::VectorXd& product,
                                 std::span<const Bounds> bounds);

/// A fixed set of columns and blocks of rows; targets and subsets of columns may change. Work that grows with
/// the number of rows is done once per set of columns and once per target. Const functions may run in several
/// threads.
class BlockRegression {
 public:
  /// `block` of each row, 0 to blocks − 1, contiguous; `folds`: number of parts to which the blocks are
  /// assigned in turn. Keeps a reference to `columns`.
  BlockRegression(const Eigen::MatrixXd& columns, std::vector<int> block, int folds);

  /// Precomputed data of a target.
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
    Eigen::VectorXd coefficients;     ///< from all rows, in the order of the selected columns
    double held_out = 0;              ///< sum of squares, each fold predicted from the others
    std::vector<double> held_out_of;  ///< the same, by block
  };
  /// Coefficients stay within `bounds` (one per column). Columns without information stay near zero.
  Fit fit(const Target& target, std::span<const Eigen::Index> columns, std::span<const Bounds> bounds) const;
  /// Fit::held_out only, faster.
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
