/// @file
/// Friction compensation from a velocity, with any friction law, and the check that it does not drive.
///
/// The base's wheels are compensated by control::FrictionCompensator, whose input is a torque command and a
/// FrictionObserver. Both take any SlidingTable, so law_table() is all that brings another law there; neither
/// is repeated here. What this file adds is help that follows a velocity, as an arm joint or an experiment
/// with a velocity reference needs it.
#pragma once
#include "model/friction/any_law.h"
#include "model/friction/sliding_table.h"

namespace model::friction {

/// A law's steady curve knows its own break-away at ±0. Holding its peak down to rest, as published curves
/// need it, would invent one for laws without.
inline constexpr SlidingTable::Grid kLawGrid{.breakaway_band_rad_per_s = 0};

/// The law's steady curve as a table, for FrictionObserver and LawCompensator.
/// @throws std::invalid_argument as SlidingTable
SlidingTable law_table(const AnyLaw& law, const SlidingTable::Grid& grid = kLawGrid);

/// u = m·d(v)·L(v)    with L the law's steady level, m the margin and
/// d(v) = sgn(v)·clamp((|v| − v_quiet)/(v_blend − v_quiet), 0, 1):
/// continuous through zero, nothing below the quiet speed. Cycle: both functions; a velocity that is not a
/// number gets no help.
class LawCompensator {
 public:
  struct Config {
    double margin = 0.9;                  ///< m, 0 to below 1: how much of the identified friction is helped
    double blend_speed_rad_per_s = 0.1;   ///< full help from this speed on; above the quiet speed
    double quiet_speed_rad_per_s = 0.02;  ///< no help up to here: noise and pre-sliding are not motion
    SlidingTable::Grid grid = kLawGrid;
  };

  /// @throws std::invalid_argument naming the value out of range.
  LawCompensator(const AnyLaw& law, const Config& config);
  /// Of a curve that is no law's, such as a drive model's; `config.grid` is not read.
  LawCompensator(SlidingTable table, const Config& config);

  /// Help for the motion that is measured.
  double from_measured_Nm(double measured_rad_per_s) const noexcept;
  /// Feed-forward of the motion that is wanted, bounded by what friction takes of the motion there is: no
  /// more than the level at the measured speed once the joint moves that way, than break-away before. It is
  /// never more than the margin of the friction it meets, and against a motion the other way at least as
  /// strong as along its own: an oscillation about rest gains nothing from it.
  double from_command_Nm(double commanded_rad_per_s, double measured_rad_per_s) const noexcept;

 private:
  double direction(double velocity_rad_per_s) const noexcept;

  SlidingTable table_;
  Config config_;
};

/// Where the compensated joint is looked at.
struct PassivityRange {
  double top_speed_rad_per_s = 10;
  double lowest_frequency_Hz = 0.5;
  double highest_frequency_Hz = 20;  ///< of oscillations about rest that must die out
};

/// By which factor from_measured_Nm() could be stronger before friction − compensation gives energy somewhere
/// in the range; infinite when it never helps. The smallest of
/// - friction/help at constant velocity, on 2000 speeds of either direction, and
/// - energy lost to friction (not to its springs) over energy brought by the help in a cycle v = A·sin(ωt)
///   about rest, A from top speed/10⁴ up in 28 steps, at nine frequencies: a joint that hangs on its
///   pre-sliding spring loses little, and help that takes such a motion for sliding drives it.
/// `friction` is the law believed to be true, which need not be the compensator's: the lower end of what was
/// identified makes the answer hold for all above. It is a search on a grid, no proof between its points.
/// Setup: about 10⁵ steps of the law. @throws std::invalid_argument when the range is not positive and
/// ordered.
double max_passive_gain(const AnyLaw& friction, const LawCompensator& compensator,
                        const PassivityRange& range = {});

/// True when the compensated joint supplies no energy anywhere in the range, as max_passive_gain() looks.
bool is_passive(const AnyLaw& friction, const LawCompensator& compensator, const PassivityRange& range = {});

}  // namespace model::friction
