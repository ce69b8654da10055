/// @file
/// Whether chance would have given a search as much as the data did.
#pragma once
#include <Eigen/Core>
#include <functional>

namespace identification {

/// A search that chooses the best of many hypotheses gains on noise, too. The same search is therefore
/// repeated on data without what it looks for, and only a gain that such data seldom give counts.
struct ChanceTest {
  /// Data as they would be without an effect. One thread.
  std::function<Eigen::VectorXd()> draw;
  /// The gain of the whole search on such data. Several threads at once.
  std::function<double(const Eigen::VectorXd&)> most_gain;
  int repetitions = 99;
  /// The answer is no, and the repetitions stop, once as many have gained as much. [J. Besag, P. Clifford,
  /// Biometrika 78, 1991]
  int enough_exceedances = 6;

  /// (1 + how many gain `gain` or more)/(1 + how many there were).
  double p_value(double gain) const;
};

}  // namespace identification
