/// @file
/// Effects on the masses, springs and gaps of a drive.
#pragma once
#include <array>

#include "model/effects/effect.h"

namespace model::effects {

struct InertiaParameters {
  double difference_kg_m2 = 0.001;  ///< added to the model's
};

/// Deviation of the moving inertia from the model's.
class Inertia : public WithParameters<Inertia, InertiaParameters> {
 public:
  static constexpr std::string_view kName = "inertia";
  static constexpr std::string_view kShows = "torque in proportion to acceleration is left over";
  static constexpr auto kParameters = std::to_array<ParameterInfo<InertiaParameters>>(
      {{"difference_kg_m2", member<&InertiaParameters::difference_kg_m2>, -1e5, 1e5}});
  using WithParameters::WithParameters;

  void arrange(Mechanics& mechanics) const noexcept {
    mechanics.inertia_kg_m2 += parameters_.difference_kg_m2;
  }
};

struct PreslidingParameters {
  double stiffness_Nm_per_rad = 250;  ///< σ0
  double damping_Nm_s_per_rad = 0;    ///< σ1, while it sticks
  double exponent = 0;                ///< α
};

/// The friction contact is elastic before breakaway.
/// σ0 and σ1 of the bristle, and how it yields: Dahl's α is 0 for a bristle that stays straight until
/// breakaway, 1 for one that bends exponentially, as in LuGre. [dahl_curve.h]
class Presliding : public WithParameters<Presliding, PreslidingParameters> {
 public:
  static constexpr std::string_view kName = "presliding";
  static constexpr std::string_view kShows =
      "the joint moves a little, and back, under torques that do not break it away; friction turns over a "
      "distance after a reversal";
  static constexpr auto kParameters = std::to_array<ParameterInfo<PreslidingParameters>>(
      {{"stiffness_Nm_per_rad", member<&PreslidingParameters::stiffness_Nm_per_rad>, 1e-6, 1e8},
       {"damping_Nm_s_per_rad", member<&PreslidingParameters::damping_Nm_s_per_rad>, 0, 1e5},
       {"exponent", member<&PreslidingParameters::exponent>, 0, 3}});
  using WithParameters::WithParameters;

  void arrange(Mechanics& mechanics) const noexcept {
    mechanics.stiffness_Nm_per_rad = parameters_.stiffness_Nm_per_rad;
    mechanics.damping_Nm_s_per_rad = parameters_.damping_Nm_s_per_rad;
    mechanics.bend_exponent = parameters_.exponent;
  }
};

struct ElasticityParameters {
  double stiffness_Nm_per_rad = 100;
  double damping_Nm_s_per_rad = 0;
  double load_share = 0.3;  ///< of inertia and friction, behind the spring
};

/// A spring between motor and load.
class Elasticity : public WithParameters<Elasticity, ElasticityParameters> {
 public:
  static constexpr std::string_view kName = "elasticity";
  static constexpr std::string_view kShows =
      "less inertia than the model's above one frequency and more just below it";
  static constexpr auto kParameters = std::to_array<ParameterInfo<ElasticityParameters>>(
      {{"stiffness_Nm_per_rad", member<&ElasticityParameters::stiffness_Nm_per_rad>, 1e-6, 1e8},
       {"damping_Nm_s_per_rad", member<&ElasticityParameters::damping_Nm_s_per_rad>, 0, 1e5},
       {"load_share", member<&ElasticityParameters::load_share>, 0.01, 0.99}});
  using WithParameters::WithParameters;

  void arrange(Mechanics& mechanics) const noexcept {
    mechanics.shaft_Nm_per_rad = parameters_.stiffness_Nm_per_rad;
    mechanics.shaft_Nm_s_per_rad = parameters_.damping_Nm_s_per_rad;
    mechanics.load_share = parameters_.load_share;
  }
};

struct BacklashParameters {
  double gap_rad = 0.01;             ///< from one flank to the other
  double load_share = 0.3;           ///< of inertia, behind the gap
  double friction_ratio = 1;         ///< share of friction behind the gap, over that of inertia
  double impact_loss_s_per_rad = 2;  ///< α: flanks that collide at a low speed v separate at (1 − α·v)·v
  double damping_ratio = 0;          ///< ζ: flanks that collide lose the same share at each speed
  double flank_Hz = 150;             ///< resonance of both masses on a flank; not fitted
};

/// Free travel between motor and load.
class Backlash : public WithParameters<Backlash, BacklashParameters> {
 public:
  static constexpr std::string_view kName = "backlash";
  static constexpr std::string_view kShows =
      "after each reversal the motor turns with little torque until it meets the other flank";
  static constexpr auto kParameters = std::to_array<ParameterInfo<BacklashParameters>>(
      {{"gap_rad", member<&BacklashParameters::gap_rad>, 1e-6, 3},
       {"load_share", member<&BacklashParameters::load_share>, 0.01, 0.99},
       {"friction_ratio", member<&BacklashParameters::friction_ratio>, 0, 20},
       {"impact_loss_s_per_rad", member<&BacklashParameters::impact_loss_s_per_rad>, 0, 1e4},
       {"damping_ratio", member<&BacklashParameters::damping_ratio>, 0, 1},
       {"flank_Hz", member<&BacklashParameters::flank_Hz>, 20, 2000}});
  using WithParameters::WithParameters;

  void arrange(Mechanics& mechanics) const noexcept {
    mechanics.backlash_rad = parameters_.gap_rad;
    mechanics.load_share = parameters_.load_share;
    mechanics.friction_ratio = parameters_.friction_ratio;
    mechanics.flank_loss_s_per_rad = parameters_.impact_loss_s_per_rad;
    mechanics.flank_damping_ratio = parameters_.damping_ratio;
    mechanics.flank_Hz = parameters_.flank_Hz;
  }
};

}  // namespace model::effects
