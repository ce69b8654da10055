/// @file
/// Learns by which factor the friction of each wheel differs from its model, from the motion of the base.
#pragma once
#include <array>

#include "control/friction_observer.h"
#include "control/link_map.h"

namespace control {

/// Friction changes with load, floor and temperature; a model measured once is right for a while. Two
/// sources:
/// - In motion, a momentum observer compares the wheels' torques, less the friction assumed, with what the
/// base
///   does: ṙ = ((d/dt)(M·V) − W(τ − s·F̂ − T̂) − r)/t_o. What it finds changes the factors s with the time
///   constant t_l. Four wheels act on three axes: a difference that does not move the base is not learned.
/// - At rest, a command that does not move a wheel shows that more is needed: the factor rises until the
/// wheel
///   moves. Without a command it falls again.
/// Nothing is learned while a wheel rests and others move: static friction may be anything below breakaway. A
/// force from outside that opposes the motion looks like friction, therefore `greatest` bounds what it can
/// cost. Cycle: all but construction.
class FrictionAdaptation {
 public:
  struct Config {
    PlanarVector inertia{48, 48, 6.8};  ///< of base and wheels, at the floor [kg, kg, kg·m²]
    double least = 0.5;                 ///< factor
    double greatest = 3.5;
    double observer_s = 0.05;       ///< t_o
    double learning_s = 0.3;        ///< t_l
    double breakaway_per_s = 3.0;   ///< rise of the factor at rest
    double full_command_Nm = 0.01;  ///< from this command on a wheel is meant to move
  };

  /// @throws std::invalid_argument naming the value out of range.
  FrictionAdaptation(const Config& config, const LinkMap& map, const std::array<double, 4>& start);

  /// The motion restarts; what was learned stays.
  void forget_motion() noexcept { started_ = false; }

  /// Once per cycle. `torque_Nm`: of the wheels, since the last step; `command_Nm`: without compensation.
  void step(const WheelVector& torque_Nm, const WheelVector& command_Nm,
            const std::array<FrictionEstimate, 4>& estimates, const PlanarVector& twist_B,
            double elapsed_s) noexcept;

  /// Of the model's friction of each wheel, now.
  std::array<double, 4> factors() const noexcept {
    return {factor_[0] + rise_[0], factor_[1] + rise_[1], factor_[2] + rise_[2], factor_[3] + rise_[3]};
  }

 private:
  void observe(const WheelVector& torque_Nm, const std::array<FrictionEstimate, 4>& estimates,
               const PlanarVector& twist_B, double elapsed_s) noexcept;
  void learn(const std::array<FrictionEstimate, 4>& estimates, double elapsed_s) noexcept;
  void rise(const WheelVector& command_Nm, const std::array<FrictionEstimate, 4>& estimates,
            double elapsed_s) noexcept;

  Config config_;
  LinkMap map_;
  std::array<double, 4> factor_;
  std::array<double, 4> rise_{};  // at rest
  bool started_ = false;
  PlanarVector momentum_ = PlanarVector::Zero();  // as the model explains it
  PlanarVector unexplained_B_ = PlanarVector::Zero();
};

}  // namespace control
