/// @file
/// The sliding friction of a drive model in the terms that other engines have.
#pragma once
#include <span>
#include <vector>

#include "model/effects/drive_model.h"

namespace analysis {

/// LuGre's friction level: sliding + (rest − sliding)·exp(−(v/velocity)²) [N·m], both at least zero.
struct Bristle {
  double sliding_Nm = 0;
  double rest_Nm = 0;
  double velocity_rad_per_s = 1;
};

/// coulomb + viscous·v + quadratic·v² + the bristles, plus a constant torque against positive motion.
struct SlidingFit {
  double coulomb_Nm = 0;
  double viscous_Nm_s_per_rad = 0;
  double quadratic_Nm_s2_per_rad2 = 0;
  std::vector<Bristle> bristles{};
  double offset_Nm = 0;
  /// Against the model, over the speeds of the fit in both directions.
  double rms_error_Nm = 0;
  double worst_error_Nm = 0;
  double worst_at_rad_per_s = 0;  ///< velocity, with its sign

  double level_Nm(double speed_rad_per_s) const noexcept;
};

enum class SlidingTerms {
  kCoulombViscous,  ///< what every engine has
  kAll,
};

/// At which an approximation should be good: `recorded` if there are any, otherwise even from 0 to the top.
std::vector<double> speeds_to_fit_rad_per_s(std::vector<double> recorded_rad_per_s, double top_rad_per_s);

/// Of the sliding friction of `model`, which may have effects of other kinds: they are ignored. A drift has
/// ended: the drive is warm. Exact where the terms can express the model, such as Stribeck friction with an
/// exponent of 2; least squares over `speeds_rad_per_s` (>= 0, not empty) otherwise, with no negative term.
SlidingFit fit_sliding(const model::effects::DriveModel& model, std::span<const double> speeds_rad_per_s,
                       SlidingTerms terms);

}  // namespace analysis
