/// @file
/// Friction compensation from a velocity, with any friction law, and the check that it does not drive.
///
/// control::FrictionCompensator compensates the base's wheels; its input is a torque command and a
/// FrictionObserver. Both take any SlidingTable, so law_table() is enough to use another law there. This file
/// adds compensation that follows a velocity, for an arm joint or an experiment with a velocity reference.
#pragma once
#include "model/friction/any_law.h"
#include "model/friction/sliding_table.h"

namespace model::friction {

/// A law's steady curve includes its own breakaway at ±0. Holding its peak down to rest, as published curves
/// need, would invent a breakaway for laws without one.
inline constexpr SlidingTable::Grid kLawGrid{.breakaway_band_rad_per_s = 0};

/// The law's steady curve as a table, for FrictionObserver and LawCompensator.
/// @throws std::invalid_argument as SlidingTable
SlidingTable law_table(const AnyLaw& law, const SlidingTable::Grid& grid = kLawGrid);

/// u = m·d(v)·L(v) with L the law's steady level, m the margin and
/// d(v) = sgn(v)·clamp((|v| − v_quiet)/(v_blend − v_quiet), 0, 1):
/// continuous through zero, zero below the quiet speed. Cycle: both functions; NaN velocities get no
/// compensation.
class LawCompensator {
 public:
  struct Config {
    double margin = 0.9;                  ///< m, 0 to below 1: compensated share of the identified friction
    double blend_speed_rad_per_s = 0.1;   ///< full compensation from this speed on; above the quiet speed
    double quiet_speed_rad_per_s = 0.02;  ///< no compensation up to here: noise and presliding are not motion
    SlidingTable::Grid grid = kLawGrid;
  };

  /// @throws std::invalid_argument naming the value out of range.
  LawCompensator(const AnyLaw& law, const Config& config);
  /// From a curve that is not a law's, such as a drive model's; `config.grid` is not used.
  LawCompensator(SlidingTable table, const Config& config);

  /// Compensation for the measured motion.
  double from_measured_Nm(double measured_rad_per_s) const noexcept;
  /// Feed-forward for the commanded motion, bounded by the friction of the actual motion: at most the level
  /// at the measured speed once the joint moves that way, at most breakaway before. It never exceeds the
  /// margin of the friction it meets, and against a motion in the other direction it is at least as strong as
  /// along its own: an oscillation about rest gains no energy from it.
  double from_command_Nm(double commanded_rad_per_s, double measured_rad_per_s) const noexcept;

 private:
  double direction(double velocity_rad_per_s) const noexcept;

  SlidingTable table_;
  Config config_;
};

/// Range over which the compensated joint is checked.
struct PassivityRange {
  double top_speed_rad_per_s = 10;
  double lowest_frequency_Hz = 0.5;
  double highest_frequency_Hz = 20;  ///< of oscillations about rest that must decay
};

/// Factor by which from_measured_Nm() could be stronger before friction − compensation supplies energy
/// somewhere in the range; infinite if it never helps. The minimum of
/// - friction/compensation at constant velocity, at 2000 speeds of either direction, and
/// - energy lost to friction (not to its springs) over energy supplied by the compensation in a cycle v =
///   A·sin(ωt) about rest, A from top speed/10⁴ up in 28 steps, at nine frequencies: a joint on its
///   presliding spring loses little, and a compensation that treats such a motion as sliding drives it.
/// `friction` is the law assumed to be true, which may differ from the compensator's: with the lower end of
/// the identified range the result holds for all above. It is a search on a grid, no proof between its
/// points.
/// Setup: about 10⁵ steps of the law. @throws std::invalid_argument if the range is not positive and ordered.
double max_passive_gain(const AnyLaw& friction, const LawCompensator& compensator,
                        const PassivityRange& range = {});

/// True if the compensated joint supplies no energy anywhere in the range, checked as in max_passive_gain().
bool is_passive(const AnyLaw& friction, const LawCompensator& compensator, const PassivityRange& range = {});

}  // namespace model::friction
