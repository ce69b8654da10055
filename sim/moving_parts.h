/// @file
/// The mechanical half of a drive: one mass with friction, or two with a gap and a spring between them.
#pragma once
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "model/effects/effect_chain.h"
#include "model/friction/sliding_table.h"
#include "sim/bounded_bristle.h"

namespace sim {

/// J·dω/dt = τ − friction(ω, z) − load(θ), integrated semi-implicitly: velocity first, then position with the
/// new velocity. Friction is the sum of a measured curve, if there is one, and of the effects; a bristle
/// carries it, so that a joint at rest rests. A friction law with memory has springs of its own and acts
/// beside the bristle. Effects that reduce friction reduce the bristle's first, then the laws' in proportion.
/// With a gap or spring the load has its shares of inertia and friction, and the motor the rest. One thread.
/// Cycle: step() neither allocates nor locks.
class MovingParts {
 public:
  /// `mechanics` includes the `effects` (EffectChain::arranged); its friction contact is a spring.
  /// @throws std::invalid_argument without one.
  MovingParts(const model::effects::Mechanics& mechanics, std::optional<model::friction::SlidingTable> curve,
              const model::effects::EffectChain& effects);

  /// One step under the torque that the motor's current means, against `load_Nm` on the load, positive if it
  /// brakes positive motion.
  void step(double motor_torque_Nm, double load_Nm, double step_s) noexcept;

  double motor_position_rad() const noexcept { return motor_.position_rad; }
  double motor_velocity_rad_per_s() const noexcept { return motor_.velocity_rad_per_s; }
  /// Of the load; the motor's if there is one mass.
  double position_rad() const noexcept { return load().position_rad; }
  double velocity_rad_per_s() const noexcept { return load().velocity_rad_per_s; }
  double friction_torque_Nm() const noexcept { return friction_torque_Nm_; }  ///< total, last step
  double inertia_kg_m2() const noexcept { return mechanics_.inertia_kg_m2; }  ///< total
  double breakaway_Nm(double direction) const noexcept {
    return std::max(contact_level_Nm(motor_, 0, direction, {}) +
                        direction * effects_.steady_laws_Nm(std::copysign(0.0, direction)),
                    0.0);
  }
  /// Longest step in which the friction laws are stable; infinite without one.
  double longest_step_s() const noexcept;
  void set_velocity(double velocity_rad_per_s) noexcept;
  void set_position(double position_rad) noexcept;
  /// Of the load only, if there is one.
  void set_load(double position_rad, double velocity_rad_per_s) noexcept {
    load_.position_rad = position_rad;
    load_.velocity_rad_per_s = velocity_rad_per_s;
  }
  /// Of the friction contacts.
  void set_deflection(double deflection_rad) noexcept {
    motor_.contact.set_deflection(deflection_rad);
    load_.contact.set_deflection(deflection_rad);
  }
  /// Of the friction laws with memory; one each, in the order of the effects.
  void set_laws(std::span<const model::friction::State> states) noexcept;
  void set_running(double running_s) noexcept { running_s_ = running_s; }  ///< time in motion so far
  /// Time since the velocity changed sign.
  void set_since_reversal(double since_reversal_s) noexcept {
    motor_.since_reversal_s = load_.since_reversal_s = since_reversal_s;
  }

 private:
  struct Mass {
    double inertia_kg_m2;
    double friction_share;
    BoundedBristle contact;
    std::vector<model::friction::State> laws{};
    double position_rad = 0;
    double velocity_rad_per_s = 0;
    double since_reversal_s = 0;
  };
  /// Torques in the direction of positive motion of the motor, and of the load against it.
  struct Effort {
    double motor_Nm = 0;
    double load_Nm = 0;
  };
  Mass mass(double inertia_share, double friction_share) const;
  const Mass& load() const noexcept { return mechanics_.two_masses() ? load_ : motor_; }
  /// Inline: most of a step depends on it. May be negative.
  double contact_level_Nm(const Mass& mass, double speed_rad_per_s, double direction,
                          const Effort& effort) const noexcept {
    const double curve_Nm = curve_ ? curve_->level_Nm(std::copysign(speed_rad_per_s, direction)) : 0;
    if (effects_.empty()) return curve_Nm;
    return curve_Nm + effects_.contact_level_under_Nm({.speed_rad_per_s = speed_rad_per_s,
                                                       .direction = direction,
                                                       .running_s = running_s_,
                                                       .position_rad = motor_.position_rad,
                                                       .since_reversal_s = mass.since_reversal_s,
                                                       .load_Nm = effort.load_Nm},
                                                      effort.motor_Nm);
  }
  double laws_Nm(Mass& mass, double torque_Nm, const Effort& effort, double step_s) const noexcept;
  /// Friction on that mass over the step; updates its velocity and position.
  double move(Mass& mass, double torque_Nm, const Effort& effort, double step_s) noexcept;
  double shaft_torque_Nm(double step_s) const noexcept;

  model::effects::Mechanics mechanics_;
  std::optional<model::friction::SlidingTable> curve_;
  model::effects::EffectChain effects_;
  Mass motor_;
  Mass load_;
  double running_s_ = 0;
  double friction_torque_Nm_ = 0;
};

}  // namespace sim
