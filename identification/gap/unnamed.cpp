#include "identification/gap/unnamed.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "identification/chance.h"
#include "identification/gap/block_comparison.h"
#include "identification/gap/chance_data.h"
#include "identification/gap/delivery.h"
#include "identification/gap/empirical_tables.h"
#include "identification/gap/regression.h"
#include "model/effects/empirical.h"

namespace identification::gap {
namespace {

using model::effects::Empirical;
using Along = Empirical::Along;
using Indices = std::vector<Eigen::Index>;

constexpr int kTermFolds = 8;
constexpr std::size_t kMaxTermsFound = 4;
/// More rows do not change a table of some dozens of values.
constexpr std::size_t kEnoughRows = 20'000;
/// In standard errors over blocks.
constexpr double kSureTerm = 2;
/// Weight of a table's bend, and of the size of its values, relative to the mean square of its columns.
constexpr double kBendWeight = 1e-3;
constexpr double kSizeWeight = 1e-8;

/// Training rows, thinned if there are many.
Training thinned(const Training& training) {
  const std::size_t stride = 1 + training.rows.size() / kEnoughRows;
  if (stride == 1) return training;
  Training result{.rows = {}, .block = {}, .least_Nm = training.least_Nm};
  for (std::size_t i = 0; i < training.rows.size(); i += stride) {
    result.rows.push_back(training.rows[i]);
    result.block.push_back(training.block[i]);
  }
  return result;
}

/// Every table with the rows of its columns, and what it predicts of a target in left-out blocks.
class Basis {
 public:
  Basis(const FittedModel& fitted, const Rows& rows, const Training& training)
      : tables_(empirical_tables(fitted, rows, training.rows)), training_(training) {
    columns_.reserve(tables_.size());
    regressions_.reserve(tables_.size());
    for (const EmpiricalTable& table : tables_) {
      columns_.emplace_back(columns_of(table, fitted, rows)(training.rows, Eigen::all));
      regressions_.emplace_back(columns_.back(), training.block, kTermFolds);
    }
  }
  Basis(const Basis&) = delete;
  Basis& operator=(const Basis&) = delete;

  std::size_t size() const noexcept { return tables_.size(); }
  const EmpiricalTable& table(std::size_t k) const { return tables_[k]; }

  /// Share of the square of `target` that a table predicts in blocks to which it was not fitted.
  double gain(std::size_t k, const Eigen::VectorXd& target) const {
    const Indices all = all_of(k);
    const std::vector<Bounds> free(all.size());
    return 1 - regressions_[k].held_out(regressions_[k].target(target), all, free) / target.squaredNorm();
  }
  double most_gain(const Eigen::VectorXd& target) const {
    double most = 0;
    for (std::size_t k = 0; k < size(); ++k) most = std::max(most, gain(k, target));
    return most;
  }

  struct Joint {
    BlockRegression::Fit fit;
    Eigen::VectorXd predicted;
  };
  /// All of these tables together.
  Joint joint(std::span<const std::size_t> chosen, const Eigen::VectorXd& target) const {
    Eigen::Index count = 0;
    for (const std::size_t k : chosen) count += columns_[k].cols();
    Eigen::MatrixXd columns(target.size(), count);
    Eigen::Index at = 0;
    for (const std::size_t k : chosen) {
      columns.middleCols(at, columns_[k].cols()) = columns_[k];
      at += columns_[k].cols();
    }
    Indices all(static_cast<std::size_t>(count));
    std::iota(all.begin(), all.end(), Eigen::Index{0});
    const std::vector<Bounds> free(all.size());
    const BlockRegression regression(columns, training_.block, kTermFolds);
    Joint result{.fit = regression.fit(regression.target(target), all, free), .predicted = {}};
    result.fit.coefficients = straightened(chosen, columns, target);
    result.predicted = columns * result.fit.coefficients;
    return result;
  }

 private:
  /// The least-squares values with a small weight on the bend of each table: values that few rows show lie
  /// between their neighbours.
  Eigen::VectorXd straightened(std::span<const std::size_t> chosen, const Eigen::MatrixXd& columns,
                               const Eigen::VectorXd& target) const {
    Eigen::MatrixXd gram = columns.transpose() * columns;
    Eigen::Index at = 0;
    for (const std::size_t k : chosen) {
      const Eigen::Index count = columns_[k].cols();
      const double weight = kBendWeight * gram.diagonal().segment(at, count).mean();
      const bool repeats = tables_[k].along == Along::kTurn;
      for (Eigen::Index i = repeats ? 0 : 1; i < (repeats ? count : count - 1); ++i) {
        const std::array<Eigen::Index, 3> own{at + (i + count - 1) % count, at + i, at + (i + 1) % count};
        constexpr std::array kBend{-1.0, 2.0, -1.0};
        for (std::size_t r = 0; r < own.size(); ++r)
          for (std::size_t c = 0; c < own.size(); ++c) gram(own[r], own[c]) += weight * kBend[r] * kBend[c];
      }
      at += count;
    }
    // Tables that hold the same constant share it.
    gram.diagonal().array() += kSizeWeight * gram.diagonal().mean();
    return gram.ldlt().solve(columns.transpose() * target);
  }
  Indices all_of(std::size_t k) const {
    Indices all(static_cast<std::size_t>(columns_[k].cols()));
    std::iota(all.begin(), all.end(), Eigen::Index{0});
    return all;
  }

  std::vector<EmpiricalTable> tables_;
  const Training& training_;
  std::vector<Eigen::MatrixXd> columns_;
  std::vector<BlockRegression> regressions_;
};

std::vector<double> block_squares(const Eigen::VectorXd& residual, const Training& training) {
  std::vector<double> squares(static_cast<std::size_t>(training.block.back()) + 1, 0);
  for (std::size_t i = 0; i < training.block.size(); ++i)
    squares[static_cast<std::size_t>(training.block[i])] +=
        residual[static_cast<Eigen::Index>(i)] * residual[static_cast<Eigen::Index>(i)];
  return squares;
}

struct Chosen {
  std::vector<std::size_t> tables;
  double p_value = 0;  ///< the largest
};

/// Forward selection, each step tested against chance, then removal of what has become superfluous.
Chosen chosen_of(const Basis& basis, const Eigen::VectorXd& residual, const Training& training,
                 const Options& options) {
  Chosen chosen;
  const double least_square = training.least_Nm * training.least_Nm * static_cast<double>(residual.size());
  Eigen::VectorXd left = residual;
  std::vector<double> squares = block_squares(residual, training);
  while (chosen.tables.size() < kMaxTermsFound) {
    std::size_t best = basis.size();
    double most = 0;
    for (std::size_t k = 0; k < basis.size(); ++k) {
      if (std::ranges::find(chosen.tables, k) != chosen.tables.end()) continue;
      const double gain = basis.gain(k, left);
      if (gain > most) {
        most = gain;
        best = k;
      }
    }
    if (most < options.least_gain || most * left.squaredNorm() < least_square) break;
    std::vector<std::size_t> more = chosen.tables;
    more.push_back(best);
    Basis::Joint joint = basis.joint(more, residual);
    if (decisiveness(squares, joint.fit.held_out_of) < kSureTerm) break;
    ChanceData chance(residual - joint.predicted, options.seed + 2);
    const double p =
        ChanceTest{.draw = [&chance] { return chance.draw(); },
                   .most_gain = [&basis](const Eigen::VectorXd& draw) { return basis.most_gain(draw); },
                   .repetitions = options.repetitions}
            .p_value(most);
    if (p > options.false_positive_rate) break;
    chosen.p_value = std::max(chosen.p_value, p);
    chosen.tables = std::move(more);
    squares = std::move(joint.fit.held_out_of);
    left = residual - joint.predicted;
  }
  for (std::size_t i = chosen.tables.size(); i-- > 0 && chosen.tables.size() > 1;) {
    std::vector<std::size_t> fewer = chosen.tables;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    if (basis.joint(chosen.tables, residual).fit.held_out <
        (1 - options.least_gain) * basis.joint(fewer, residual).fit.held_out)
      continue;
    chosen.tables = std::move(fewer);
    i = chosen.tables.size();
  }
  return chosen;
}

Empirical effect_of(const Basis& basis, std::span<const std::size_t> chosen,
                    const Eigen::VectorXd& coefficients) {
  std::vector<Empirical::Term> terms;
  Eigen::Index at = 0;
  for (const std::size_t k : chosen) {
    const EmpiricalTable& table = basis.table(k);
    const auto* const first = coefficients.data() + at;
    terms.push_back({table.along, table.times, table.with({first, first + table.values})});
    at += static_cast<Eigen::Index>(table.values);
  }
  return Empirical(std::move(terms));
}

}  // namespace

std::optional<UnnamedEffect> find_unnamed(const FittedModel& delivered, const Judged& judged,
                                          const Options& options) {
  const Training training = thinned(judged.training);
  const Eigen::VectorXd residual =
      (judged.rows.torque_Nm() - predicted_rows(delivered, judged.rows))(training.rows);
  const Basis basis(delivered, judged.rows, training);
  Chosen chosen = chosen_of(basis, residual, training, options);
  for (; !chosen.tables.empty(); chosen.tables.pop_back()) {
    const Basis::Joint joint = basis.joint(chosen.tables, residual);
    FittedModel with = delivered;
    with.model.effects.emplace_back(effect_of(basis, chosen.tables, joint.fit.coefficients));
    const HeldOutComparison judgement = compared(delivered, with, judged);
    if (!judgement.worse_at.empty() || judgement.decisiveness < kSureTerm ||
        judgement.gain < options.least_gain)
      continue;
    UnnamedEffect found{.effect = with.model.effects.back()};
    found.held_out_gain = judgement.gain;
    found.blocks = judgement.blocks;
    found.blocks_improved = judgement.blocks_improved;
    found.p_value = chosen.p_value;
    found.gap_before_Nm = judgement.before_Nm;
    found.gap_after_Nm = judgement.after_Nm;
    const double removable = std::pow(judgement.before_Nm, 2) - std::pow(judged.noise_floor_Nm, 2);
    if (removable > 0)
      found.removable_share =
          std::min(1.0, (std::pow(judgement.before_Nm, 2) - std::pow(judgement.after_Nm, 2)) / removable);
    found.simulation_before_rad_per_s = judgement.simulation_before_rad_per_s;
    found.simulation_after_rad_per_s = judgement.simulation_after_rad_per_s;
    return found;
  }
  return {};
}

}  // namespace identification::gap
