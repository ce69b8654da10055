/// @file
/// The inertia and friction that a recording implies, independent of a model.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "identification/gap/even_rows.h"
#include "identification/gap/gap.h"
#include "model/effects/drive_model.h"

namespace identification::gap {

/// At even steps, and slow enough for a rough estimate: below 5 Hz and a tenth of the sample rate.
struct SmoothMotion {
  EvenRows rows;
  std::vector<double> position_rad;  ///< empty without such a column
  std::vector<double> velocity_rad_per_s;
};
SmoothMotion smooth_motion_of(const Source& source);
/// A column of the same recording, in the same rows and the same band.
std::vector<double> smooth(const SmoothMotion& motion, std::span<const double> column);

/// Inertia and friction of τ = J·a + c·sign(v) + b·v + d, with standard deviations; with additional terms
/// s·sin(q) + k·cos(q) if a weight explains most of the residual.
struct ImpliedDrive {
  double inertia_kg_m2;
  double inertia_sigma;
  double inertia_share;  ///< share of the squared torque left by the other terms that J·a removes
  double coulomb_Nm;
  double coulomb_sigma;
  double viscous_Nm_s_per_rad;
  /// Mean power of c·sign(v) + b·v: friction loss. The power of the whole torque also lifts and lowers the
  /// joint, so it is not meaningful if the joint does not return.
  double friction_W;
  /// Five standard deviations from zero.
  bool inertia_is_sure() const noexcept;
  bool friction_is_sure() const noexcept;
};
enum class Quadrants : std::uint8_t { kAll, kBraking };  ///< braking: the torque acts against the motion
/// Empty without a torque or with too little motion.
std::optional<ImpliedDrive> implied_by(const Source& source, const SmoothMotion& motion,
                                       Quadrants quadrants = Quadrants::kAll);

/// The inertia on which the recordings, and braking and driving, agree, if it differs from that of `base` by
/// more than a factor of five. A search that starts this far off would explain the difference with any effect
/// that follows the acceleration.
std::optional<double> another_inertia(std::span<const Source> sources,
                                      const model::effects::DriveModel& base);

}  // namespace identification::gap
