#include "model/even_table.h"

#include <stdexcept>
#include <utility>

namespace model {

EvenTable EvenTable::over(double from, double to, std::vector<double> values) {
  return {from, to, false, std::move(values)};
}

EvenTable EvenTable::of_a_turn(std::vector<double> values) {
  return {0, 2 * std::numbers::pi, true, std::move(values)};
}

EvenTable::EvenTable(double from, double to, bool repeats, std::vector<double> values)
    : from_(from), to_(to), repeats_(repeats), values_(std::move(values)) {
  if (!(std::isfinite(from_) && std::isfinite(to_) && from_ < to_))
    throw std::invalid_argument("table: it needs two finite ends, the first below the last");
  if (values_.size() < 2 || !std::ranges::all_of(values_, [](double value) { return std::isfinite(value); }))
    throw std::invalid_argument("table: it needs two or more values, all finite");
}

}  // namespace model
