/// @file
/// Learns by which factor the friction of each wheel differs from its model, from the motion of the base.
#pragma once
#include <array>

#include "control/friction_observer.h"
#include "control/link_map.h"

namespace control {

/// A model is measured once; load, floor and temperature change friction. Two sources correct it:
/// - In motion, a momentum observer compares the wheels' torques τ, less the friction kF̂ + T̂ that is assumed,
///   with the momentum of the base: ṙ = (d(M·V)/dt − W(τ − kF̂ − T̂) − r)/t_o. The wrench r that it finds
///   changes the factors k with the time constant t_l. Four wheels act on three axes: a difference that does
///   not move the base is not learned. It learns while all four wheels slide, because a wheel at rest may
///   hold any torque below breakaway.
/// - At rest, a command that moves no wheel shows that more is needed: all factors rise until the wheels
///   move. What does not move with the greatest factor is held by something else: the factors fall again,
///   until there is another command. Without a command they fall, too.
/// A force on the base is taken for friction: one that opposes the motion raises the factors, to `greatest`
/// at most, one that helps it lowers them. Cycle: all but construction.
class FrictionAdaptation {
 public:
  struct Config {
    PlanarVector inertia{48, 48, 6.8};  ///< of base and wheels, at the floor [kg, kg, kg·m²]
    double least = 0.5;                 ///< factor
    /// From about 2.5 on, a base that is held may turn: the help then exceeds the friction of the wheels by
    /// more than they differ.
    double greatest = 2.0;
    double observer_s = 0.05;       ///< t_o
    double learning_s = 0.3;        ///< t_l
    double rise_per_s = 3.0;        ///< at rest
    double full_command_Nm = 0.01;  ///< from this command on a wheel is meant to move
  };

  /// `start`: factors. @throws std::invalid_argument naming the value out of range.
  FrictionAdaptation(const Config& config, const LinkMap& map, const std::array<double, 4>& start);

  /// The motion restarts; what was learned in motion stays.
  void forget_motion() noexcept;

  /// Once per cycle. `torque_Nm`: of the wheels, since the last step; `command_Nm`: without compensation. A
  /// gap of more than half of t_o restarts the observer, as does a value that is not finite.
  void step(const WheelVector& torque_Nm, const WheelVector& command_Nm,
            const std::array<FrictionEstimate, 4>& estimates, const PlanarVector& twist_B,
            double elapsed_s) noexcept;

  /// Of the model's friction of each wheel, now.
  std::array<double, 4> factors() const noexcept;

 private:
  void observe(const WheelVector& torque_Nm, const std::array<FrictionEstimate, 4>& estimates,
               const PlanarVector& twist_B, double elapsed_s) noexcept;
  void learn(const std::array<FrictionEstimate, 4>& estimates, double elapsed_s) noexcept;
  void rise(const WheelVector& command_Nm, double elapsed_s) noexcept;
  double bounded(double factor) const noexcept;

  Config config_;
  LinkMap map_;
  std::array<double, 4> factor_;
  double rise_ = 0;  // at rest
  bool blocked_ = false;
  double sliding_s_ = 0;  // all wheels, without interruption
  bool started_ = false;
  PlanarVector momentum_ = PlanarVector::Zero();  // as the model explains it
  PlanarVector unexplained_B_ = PlanarVector::Zero();
};

}  // namespace control
