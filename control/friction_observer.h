/// @file
/// Estimates a joint's friction from its position alone (thesis 2.7.2, figures 27 and 30).
#pragma once
#include <algorithm>
#include <cmath>
#include <optional>

#include "control/state_variable_filter.h"
#include "model/friction/sliding_table.h"
#include "model/position_torque.h"

namespace control {

struct FrictionEstimate {
  double velocity_rad_per_s = 0.0;  ///< filtered
  double friction_Nm = 0.0;  ///< sliding friction with the sign of the velocity; continuous through zero
                             ///< velocity

  double rest = 1.0;         ///< 1 at standstill, 0 at the blend speed and above, linear between
  double position_Nm = 0.0;  ///< position-dependent torque against positive motion
};

/// One observer per joint; owns its filter state. Cycle: step().
class FrictionObserver {
 public:
  struct Config {
    StateVariableFilter::Config filter;
    /// Below this speed the sign of the velocity is uncertain, and the estimate fades linearly to zero.
    double blend_speed_rad_per_s = 0.05;
  };

  /// @throws std::invalid_argument as StateVariableFilter, or when the blend speed is not positive.
  FrictionObserver(model::friction::SlidingTable table, const Config& config,
                   model::PositionTorque position = {});

  void reset(double position_rad) noexcept { filter_.reset(position_rad); }
  /// `elapsed_s` as in StateVariableFilter::step().
  FrictionEstimate step(double position_rad, std::optional<double> elapsed_s = {}) noexcept;

  /// Torque that resists a motion in the direction of `direction` at `speed`: sliding friction, at most the
  /// breakaway torque.
  double holding_Nm(double speed_rad_per_s, double direction) const noexcept {
    return std::min(table_.breakaway_Nm(direction),
                    table_.level_Nm(std::copysign(speed_rad_per_s, direction)));
  }

 private:
  model::friction::SlidingTable table_;
  model::PositionTorque position_;
  StateVariableFilter filter_;
  double blend_speed_rad_per_s_;
};

}  // namespace control
