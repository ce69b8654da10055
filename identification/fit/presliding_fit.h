/// @file
/// Stiffness and damping of the contact, from torques below breakaway.
#pragma once
#include <string>
#include <vector>

#include "identification/fit/statistics.h"
#include "identification/recording.h"
#include "model/friction/kfm.h"

namespace identification::fit {

struct PreslidingFitOptions {
  double inertia_kg_m2 = 0;                    ///< known, positive
  model::friction::Kfm::Parameters sliding{};  ///< known, from a steady-state map
  /// Resolution of the encoder; 0: the smallest step in the positions.
  double resolution_rad = 0;
};

struct PreslidingFit {
  /// Stiffness (σ0) and damping (σ1) of the effect presliding, its exponent, as in LuGre, the torque_offset
  /// (Fg), position_offset_rad (y0)
  std::vector<Estimate> parameters;
  double rms_error_rad = 0;           ///< simulated minus measured position
  double relative_error_percent = 0;  ///< of the position about its mean
  std::vector<std::string> verdicts;
};

/// Free simulation of J·dv/dt = τ − F_LuGre(v) − Fg, x(0) = y0, from rest and relaxed, fitted to position_rad
/// from several starts [thesis 2.5.2]. τ is torque_measured_Nm, without it torque_command_Nm; it holds until
/// the next row. Intervals allow for residuals that are correlated over time.
///
/// A reason instead of a number if
/// - the torque never reverses (σ0 and σ1 show where the velocity does),
/// - the delivered torque differs from the commanded one, or skips small values, by more than a tenth of the
///   static friction: the missing part would show σ0 and σ1 (the thesis' 0.03 N·m motor offset),
/// - the position moves by fewer than 20 steps of the encoder,
/// - for σ1 only: its interval spans more than a factor of four, or a tenth or ten times of it leaves less
///   than 5 % more: the motion does not excite it.
/// @throws std::invalid_argument for a missing column, an uneven sample rate or a non-positive inertia.
PreslidingFit fit_presliding(const Recording& recording, const PreslidingFitOptions& options);

}  // namespace identification::fit
