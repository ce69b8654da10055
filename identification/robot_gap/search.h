/// @file
/// Selects the effects that a robot's model lacks.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "identification/gap/regression.h"
#include "identification/robot_gap/subject.h"

namespace identification::robot_gap {

struct SearchOptions {
  double false_positive_rate = 0.01;  ///< of the whole search, per effect added
  int repetitions = 99;               ///< of the search on chance data
  double least_gain = 0.02;           ///< share of the squared residual that an effect must remove
  double least_of_all = 3e-4;         ///< the same of the given model's: less is within its approximations
  std::uint64_t seed = 1;
};

/// One part of a robot's recordings, with the weights of its channels.
struct View {
  const Subject& subject;
  Part part;
  Eigen::VectorXd sigma;  ///< of each channel: what a good model leaves; rows count in this unit

  const RowPlan& plan() const { return subject.plan(part); }
  const Catalogue& catalogue() const { return subject.catalogue(); }
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

/// Without changes and delay.
Fitted as_given(const Subject& subject);

/// A comparison that is linear in some terms: residuals of the given model, and their derivatives by those
/// terms, taken at a fitted one. Columns of the terms, then that of the delay, which every model has.
class Linearised {
 public:
  /// Of all terms of the catalogue.
  Linearised(const View& view, const Fitted& at);
  /// Of the terms of these candidates alone.
  Linearised(const View& view, const Fitted& at, const Chosen& candidates);
  Linearised(const Linearised&) = delete;
  Linearised& operator=(const Linearised&) = delete;

  /// Columns of these candidates, each once, and the delay.
  std::vector<Eigen::Index> columns_of(const Chosen& chosen) const;
  gap::BlockRegression::Fit fit(const Chosen& chosen) const;
  double left_out(const Chosen& chosen) const;
  std::vector<gap::Bounds> bounds_of(std::span<const Eigen::Index> columns) const;
  /// The changes that coefficients of these columns are.
  Fitted fitted(std::span<const Eigen::Index> columns, const Eigen::VectorXd& coefficients) const;

  const Eigen::MatrixXd& columns() const noexcept { return columns_; }
  const Eigen::VectorXd& residual() const noexcept { return residual_; }
  const gap::BlockRegression& regression() const noexcept { return regression_; }
  /// Of a term among the columns.
  Eigen::Index column_of(std::size_t term) const;

 private:
  struct Terms {
    std::vector<std::size_t> list;
  };
  Linearised(const View& view, const Fitted& at, Terms terms);

  const Subject& subject_;
  std::vector<std::size_t> terms_;  // of each column but the last
  Eigen::MatrixXd columns_;
  Eigen::VectorXd residual_;  // in units of sigma
  gap::BlockRegression regression_;
  gap::BlockRegression::Target target_;
};

struct SearchOutcome {
  Fitted fitted;
  Chosen chosen;
  std::vector<Added> added;  ///< in the order of `chosen`
  std::optional<LeftOut> next;
};

/// Adds candidates one by one, exchanges and removes them again, without those in `banned`. Deterministic for
/// a seed.
SearchOutcome search(const View& view, std::span<const std::size_t> banned, const SearchOptions& options);

/// The chosen terms, fitted.
Fitted fit_chosen(const View& view, const Chosen& chosen);

/// Squared residual of each block, left out in turn, of the chosen candidates fitted on their own.
std::vector<double> left_out_squares(const View& view, const Chosen& chosen);

/// With the candidate, in place of another variant of its effect.
Chosen with_candidate(Chosen chosen, std::size_t candidate, const Catalogue& catalogue);

}  // namespace identification::robot_gap
