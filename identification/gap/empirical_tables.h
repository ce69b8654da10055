/// @file
/// Tables that may describe a torque without a name, as columns of a regression.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <utility>
#include <vector>

#include "identification/gap/fitted_model.h"
#include "model/effects/empirical.h"

namespace identification::gap {

/// A table that may become a term. Its values are columns of a regression.
struct EmpiricalTable {
  model::effects::Empirical::Along along;
  model::effects::Empirical::Times times;
  double from = 0;
  double to = 0;
  std::size_t values = 0;

  model::EvenTable with(std::vector<double> numbers) const {
    return along == model::effects::Empirical::Along::kTurn
               ? model::EvenTable::of_a_turn(std::move(numbers))
               : model::EvenTable::over(from, to, std::move(numbers));
  }
};

/// All that these rows can show: in each quantity and factor of model::effects::Empirical a few resolutions,
/// over the range that nearly all rows of `use` cover.
std::vector<EmpiricalTable> empirical_tables(const FittedModel& fitted, const Rows& rows,
                                             const std::vector<Eigen::Index>& use);
/// Torque of each value of a table at 1, over all rows.
Eigen::MatrixXd columns_of(const EmpiricalTable& table, const FittedModel& fitted, const Rows& rows);

}  // namespace identification::gap
