/// @file
/// A torque that repeats over position faster than the analysed band passes.
#pragma once
#include <optional>
#include <span>
#include <string>

#include "identification/gap/signals.h"
#include "model/effects/drive_model.h"

namespace identification::gap {

/// One harmonic of the measured torque at the raw rate, above the band: an unmodelled ripple, to which the
/// rig's own loop or its current sensor responds.
struct FastRipple {
  double periods_per_rev = 0;
  double amplitude_Nm = 0;
  bool commanded = false;  ///< the command has it too
};

/// The strongest harmonic over position in what the band leaves of the measured torque. Empty if the torque
/// was not measured, or unless it is far above its neighbours and has the same size and phase in all quarters
/// of the data.
std::optional<FastRipple> fast_ripple(std::span<const Signals> signals);

/// Maximum number of periods per turn that the band passes at the slowest speeds; 0 if nothing moves.
double most_periods_shown(std::span<const Signals> signals);

/// For the report; empty without such a ripple, or if `found` has it as cogging.
std::string fast_ripple_note(std::span<const Signals> signals, const model::effects::DriveModel& found);

}  // namespace identification::gap
