/// @file
/// A function given at even steps.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace model {

/// Linear between its values. Cycle: at() neither allocates nor locks.
class EvenTable {
 public:
  /// `values` at even steps from `from` to `to`; beyond both ends the last value holds.
  /// @throws std::invalid_argument unless from < to and there are at least two values, all finite.
  static EvenTable over(double from, double to, std::vector<double> values);
  /// `values` at even steps of one turn, from 0 on; the turn repeats.
  /// @throws std::invalid_argument likewise.
  static EvenTable of_a_turn(std::vector<double> values);

  double from() const noexcept { return from_; }
  double to() const noexcept { return to_; }
  bool repeats() const noexcept { return repeats_; }
  const std::vector<double>& values() const noexcept { return values_; }
  double least() const noexcept { return *std::ranges::min_element(values_); }

  /// Share of each of two neighbouring values in the function at `x`.
  struct Between {
    std::size_t lower;
    std::size_t upper;
    double share;  ///< of the upper one
  };
  Between between(double x) const noexcept {
    const std::size_t count = values_.size();
    const double steps = static_cast<double>(repeats_ ? count : count - 1);
    double at = (x - from_) / (to_ - from_);
    at = (repeats_ ? at - std::floor(at) : std::clamp(at, 0.0, 1.0)) * steps;
    if (!(at >= 0)) at = 0;  // NaN has no place
    const std::size_t last = repeats_ ? count - 1 : count - 2;
    const std::size_t lower = std::min(static_cast<std::size_t>(at), last);
    return {lower, (lower + 1) % count, at - static_cast<double>(lower)};
  }
  double at(double x) const noexcept {
    const Between place = between(x);
    return values_[place.lower] + place.share * (values_[place.upper] - values_[place.lower]);
  }

 private:
  EvenTable(double from, double to, bool repeats, std::vector<double> values);

  double from_;
  double to_;
  bool repeats_;
  std::vector<double> values_;
};

}  // namespace model
