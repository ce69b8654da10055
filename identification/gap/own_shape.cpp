#include "identification/gap/own_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "identification/gap/block_comparison.h"
#include "identification/gap/empirical_tables.h"
#include "identification/gap/regression.h"

namespace identification::gap {
namespace {

using Along = model::effects::Empirical::Along;
using Times = model::effects::Empirical::Times;

constexpr int kShapeFolds = 8;
/// Share of the square removed by a table that a named effect removes at least.
constexpr double kMostOfIt = 0.75;
/// In standard errors over blocks.
constexpr double kSurelyOther = 2;

struct OwnCoordinate {
  std::string_view effect;
  Along along;
  Times times;
};
constexpr auto kCoordinates =
    std::to_array<OwnCoordinate>({{"coulomb", Along::kVelocity, Times::kOne},
                                  {"viscous", Along::kVelocity, Times::kOne},
                                  {"stribeck", Along::kVelocity, Times::kOne},
                                  {"midspeed_dip", Along::kVelocity, Times::kOne},
                                  {"quadratic_drag", Along::kVelocity, Times::kOne},
                                  {"direction_asymmetry", Along::kVelocity, Times::kOne},
                                  {"imbalance", Along::kTurn, Times::kOne},
                                  {"imbalance", Along::kPosition, Times::kOne},
                                  {"cogging", Along::kTurn, Times::kOne},
                                  {"cogging", Along::kPosition, Times::kOne},
                                  {"load_friction", Along::kLoad, Times::kDirection}});

/// The least squares of left-out blocks with a table over a coordinate of `effect` added to `without`; empty
/// if it has none.
std::vector<double> squares_with_table(std::string_view effect, const FittedModel& without,
                                       const Judged& judged) {
  const std::vector<Eigen::Index>& use = judged.training.rows;
  const auto is_own = [&](const EmpiricalTable& table) {
    return std::ranges::any_of(kCoordinates, [&](const OwnCoordinate& own) {
      return own.effect == effect && own.along == table.along && own.times == table.times;
    });
  };
  std::vector<EmpiricalTable> tables = empirical_tables(without, judged.rows, use);
  std::erase_if(tables, [&](const EmpiricalTable& table) { return !is_own(table); });
  if (tables.empty()) return {};
  const auto parameters = free_parameters(without, judged.rows);
  const Eigen::MatrixXd jacobian = prediction_jacobian(without, judged.rows, parameters)(use, Eigen::all);
  const Eigen::VectorXd residual = (judged.rows.torque_Nm() - predicted_rows(without, judged.rows))(use);
  std::vector<double> least;
  double least_sum = std::numeric_limits<double>::infinity();
  for (const EmpiricalTable& table : tables) {
    const auto count = static_cast<Eigen::Index>(table.values);
    Eigen::MatrixXd columns(jacobian.rows(), jacobian.cols() + count);
    columns << jacobian, columns_of(table, without, judged.rows)(use, Eigen::all);
    std::vector<Bounds> bounds;
    for (const FreeParameter& p : parameters) bounds.push_back({p.lower - p.value, p.upper - p.value});
    bounds.resize(static_cast<std::size_t>(columns.cols()));
    std::vector<Eigen::Index> all(bounds.size());
    std::iota(all.begin(), all.end(), Eigen::Index{0});
    const BlockRegression regression(columns, judged.training.block, kShapeFolds);
    BlockRegression::Fit fit = regression.fit(regression.target(residual), all, bounds);
    if (fit.held_out >= least_sum) continue;
    least_sum = fit.held_out;
    least = std::move(fit.held_out_of);
  }
  return least;
}

double sum_of_squares(std::span<const double> squares) {
  return std::accumulate(squares.begin(), squares.end(), 0.0);
}

}  // namespace

void drop_misshapen(SearchResult& result, const Judged& judged) {
  for (std::size_t i = result.added.size(); i-- > 0;) {
    const std::optional<FittedModel> without = without_added(result, i, judged.rows, judged.training);
    if (!without) continue;
    const std::vector<double> table = squares_with_table(result.added[i].effect, *without, judged);
    if (table.empty()) continue;
    const std::vector<double> bare = left_out_squares(*without, judged.rows, judged.training);
    const std::vector<double> named = left_out_squares(result.fitted, judged.rows, judged.training);
    const bool has_its_shape = sum_of_squares(bare) - sum_of_squares(named) >=
                               kMostOfIt * (sum_of_squares(bare) - sum_of_squares(table));
    if (has_its_shape || decisiveness(named, table) < kSurelyOther) continue;
    result.rejected.push_back({std::string(result.added[i].effect), result.added[i].gain,
                               "what it takes away has another shape over the same coordinate"});
    result.fitted = *without;
    result.added.erase(result.added.begin() + static_cast<std::ptrdiff_t>(i));
    i = result.added.size();  // the remaining ones now remove something else
  }
}

}  // namespace identification::gap
