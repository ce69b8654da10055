/// @file
/// The inertia and friction that a recording implies, whatever a model says.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "identification/gap/gap.h"
#include "model/effects/drive_model.h"

namespace identification::gap {

/// Slow enough for a rough look: below 5 Hz and a tenth of the sample rate.
struct SmoothMotion {
  double period_s = 0;
  std::vector<double> position_rad;  ///< empty without such a column
  std::vector<double> velocity_rad_per_s;
};
double smooth_Hz(double period_s);
SmoothMotion smooth_motion_of(const Source& source);

/// Inertia and friction of τ = J·a + c·sign(v) + b·v + d, with standard deviations; where a weight explains
/// most of what that leaves, of the same and s·sin(q) + k·cos(q).
struct ImpliedDrive {
  double inertia_kg_m2;
  double inertia_sigma;
  double inertia_share;  ///< of the squared torque that the other terms leave, what J·a takes away
  double coulomb_Nm;
  double coulomb_sigma;
  double viscous_Nm_s_per_rad;
  /// Of c·sign(v) + b·v, in the mean: what friction takes. The power of the whole torque also lifts and
  /// lowers the joint, so that it says nothing where the joint does not come back.
  double friction_W;
  /// Five standard deviations from zero.
  bool inertia_is_sure() const noexcept;
  bool friction_is_sure() const noexcept;
};
enum class Quadrants : std::uint8_t { kAll, kBraking };  ///< braking: the torque acts against the motion
/// None without a torque or with too little motion.
std::optional<ImpliedDrive> implied_by(const Source& source, const SmoothMotion& motion,
                                       Quadrants quadrants = Quadrants::kAll);

/// The inertia that recordings agree on, and braking with driving, when it is that of `base` neither roughly
/// nor at all: more than five times as large or small. A search that begins so far off would explain the
/// difference with anything that goes with the acceleration.
std::optional<double> another_inertia(std::span<const Source> sources,
                                      const model::effects::DriveModel& base);

}  // namespace identification::gap
