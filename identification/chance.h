/// @file
/// Tests whether a search gains as much on chance data as on the measured data.
#pragma once
#include <Eigen/Core>
#include <functional>

namespace identification {

/// A search that selects the best of many hypotheses gains on noise, too. The same search is therefore
/// repeated on data without the effect, and a gain counts only if such data seldom give it.
struct ChanceTest {
  /// Data as they would be without an effect. One thread.
  std::function<Eigen::VectorXd()> draw;
  /// The gain of the whole search on such data. Called by several threads.
  std::function<double(const Eigen::VectorXd&)> most_gain;
  int repetitions = 99;
  /// Repetition stops, with a negative result, once this many have gained as much. [J. Besag, P. Clifford,
  /// Biometrika 78, 1991]
  int enough_exceedances = 6;

  /// (1 + number of draws that gain at least `gain`)/(1 + number of draws).
  double p_value(double gain) const;
};

}  // namespace identification
