/// @file
/// Selects the effects that an arm's model lacks.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "identification/gap/regression.h"
#include "identification/robot_gap/arm_rows.h"

namespace identification::robot_gap {

struct SearchOptions {
  double false_positive_rate = 0.01;  ///< of the whole search, per effect added
  int repetitions = 99;               ///< of the search on chance data
  double least_gain = 0.02;           ///< share of the squared residual that an effect must remove
  double least_of_all = 3e-4;         ///< the same of the given model's: less is within its approximations
  std::uint64_t seed = 1;
};

/// Recordings on which a search works. The motions must outlive it.
struct ArmData {
  std::span<const ArmMotion> motions;
  RowPlan plan;
  Eigen::VectorXd sigma_Nm;  ///< of each joint: what a good model leaves; rows count in this unit
  Eigen::VectorXd floor_Nm;  ///< of each joint: what noise alone leaves
};

/// Candidates that were added, by their index in the catalogue.
using Chosen = std::vector<std::size_t>;

/// Why a candidate counts.
struct Added {
  std::size_t candidate = 0;
  double gain = 0;  ///< share of the squared residual left out in turn
  int blocks_improved = 0;
  int blocks = 0;
  double p_value = 1;  ///< probability of such a gain by chance, anywhere in the search
};
/// The best candidate that was not added.
struct LeftOut {
  std::size_t candidate = 0;
  double gain = 0;
  std::string reason;
};

/// A comparison that is linear in all terms: residuals of the given description, and their derivatives by
/// every term, taken at a fitted one. Coefficients are changes from the given description. Columns of the
/// terms, then that of the torque's lag, which every model has.
class Linearised {
 public:
  /// `chosen`: candidates in which `at` differs from `given`.
  Linearised(const control::ArmDescription& given, const control::ArmDescription& at, const Chosen& chosen,
             const ArmData& data, const Catalogue& catalogue);
  Linearised(const Linearised&) = delete;
  Linearised& operator=(const Linearised&) = delete;

  /// Columns of these candidates, each once, and the lag.
  std::vector<Eigen::Index> columns_of(const Chosen& chosen) const;
  gap::BlockRegression::Fit fit(const Chosen& chosen) const;
  double left_out(const Chosen& chosen) const;
  std::vector<gap::Bounds> bounds_of(std::span<const Eigen::Index> columns) const;

  const Eigen::MatrixXd& columns() const noexcept { return columns_; }
  const Eigen::VectorXd& residual() const noexcept { return residual_; }
  const gap::BlockRegression& regression() const noexcept { return regression_; }
  Eigen::Index lag_column() const noexcept { return columns_.cols() - 1; }

 private:
  control::ArmDescription given_;
  const Catalogue& catalogue_;
  Eigen::MatrixXd columns_;
  Eigen::VectorXd residual_;  // in units of sigma
  gap::BlockRegression regression_;
  gap::BlockRegression::Target target_;
};

struct SearchOutcome {
  control::ArmDescription arm;  ///< with the fitted values
  Chosen chosen;
  std::vector<Added> added;  ///< in the order of `chosen`
  std::optional<LeftOut> next;
};

/// Adds candidates one by one, exchanges and removes them again, without those in `banned`. Deterministic for
/// a seed.
SearchOutcome search(const control::ArmDescription& given, const ArmData& data, const Catalogue& catalogue,
                     std::span<const std::size_t> banned, const SearchOptions& options);

/// The description with the chosen terms fitted to the data, and the torque's lag [s].
struct FittedArm {
  control::ArmDescription arm;
  double lag_s = 0;
};
FittedArm fitted_arm(const control::ArmDescription& given, const ArmData& data, const Catalogue& catalogue,
                     const Chosen& chosen);

/// Squared residual of each block, left out in turn, of the chosen candidates fitted on their own.
std::vector<double> left_out_squares(const control::ArmDescription& given, const ArmData& data,
                                     const Catalogue& catalogue, const Chosen& chosen);

/// With the candidate, in place of another variant of its effect.
Chosen with_candidate(Chosen chosen, std::size_t candidate, const Catalogue& catalogue);

}  // namespace identification::robot_gap
