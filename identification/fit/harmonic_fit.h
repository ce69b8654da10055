/// @file
/// Position-dependent torque: cogging, imbalance, gear meshing, as harmonics of one turn.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "identification/fit/statistics.h"

namespace identification::fit {

/// A quantity (torque, or the current that holds a position) at angles of one turn, any number of turns.
struct PositionMap {
  std::vector<double> position_rad;
  std::vector<double> value;
};

struct Harmonic {
  int per_turn = 0;
  double cosine = 0;          ///< in the unit of the values, as is
  double sine = 0;            ///< value = … + cosine·cos(k·θ) + sine·sin(k·θ)
  double amplitude_ci95 = 0;  ///< half the 95 % interval
  double amplitude() const;
};

struct HarmonicFitOptions {
  int most_harmonics = 16;
  int highest_per_turn = 200;
  /// A harmonic is added while the held-out error falls by more than this share of itself.
  double least_gain = 0.02;
  /// Not 0: exactly so many, whether or not the map supports them.
  int harmonics = 0;
};

struct HarmonicFit {
  double mean = 0;
  std::vector<Harmonic> harmonics;  ///< in the order they were added, the largest first
  double r_squared = 0;             ///< on the map of the fit
  double held_out_r_squared = 0;    ///< each twelfth of a turn predicted from the others
  std::vector<std::string> verdicts;

  double at(double position_rad) const;
  /// On another map. @throws std::invalid_argument when it is empty or lengths differ.
  double r_squared_on(const PositionMap& map) const;
};

/// Adds, one by one, the harmonic that takes most from the residual, refitting all; stops when predicting
/// stretches of a turn from the rest no longer improves. Highest considered: options, and half the number of
/// points per turn. Intervals allow for residuals that are alike at neighbouring positions.
/// A map that covers less than a turn has no harmonics: mean only, and a verdict says so.
/// @throws std::invalid_argument for fewer than 16 points, lengths that differ or what is not a number.
HarmonicFit fit_harmonics(const PositionMap& map, const HarmonicFitOptions& options = {});

}  // namespace identification::fit
