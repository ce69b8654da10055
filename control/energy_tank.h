/// @file
/// Limits the energy that a haptic device returns to the hand to what the hand put in: passivity observer and
/// controller (Hannaford and Ryu, IEEE Trans. Robotics and Automation 18:1, 2002) with an energy tank.
#pragma once
#include <Eigen/Core>

namespace control {

/// The tank holds the energy that the hand has put in, at most what the coupling spring stores now plus a
/// small reserve. Energy that the robot puts into the spring by its own motion, for example when only the
/// handle's orientation changes, is therefore never available to the hand, while a spring that the hand has
/// loaded returns all its energy. As the tank empties, the force that would drain it fades out and a damper
/// fades in. A force that the hand moves against is never reduced, and refills the tank. The energy absorbed
/// by the damper is lost.
///
/// A device can remove a force only at a rate R. Meanwhile a force F along the speed v of a mass m delivers
/// F²·v/(2R) + F⁴/(8·m·R²). The force is limited so that the tank covers this energy. One thread. Cycle: all
/// but construction.
class EnergyTank {
 public:
  struct Config {
    double reserve_J = 0.005;
    double damping_N_s_per_m = 3.0;     ///< of the damper, when the tank is empty
    double force_rate_N_per_s = 200.0;  ///< how fast the device can remove a force
    double device_mass_kg = 0.3;        ///< minimum mass that the force still accelerates
    /// Speed of the hand against the force at which an empty tank passes the full force.
    double against_speed_m_per_s = 0.01;
    bool active = true;  ///< false: observes only
  };
  struct Output {
    Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
    double withheld_N = 0.0;  ///< wanted minus commanded force, without the damper
  };

  /// @throws std::invalid_argument naming the value out of range.
  explicit EnergyTank(const Config& config);

  /// Holds the reserve only.
  void reset() noexcept;
  /// One cycle. `held_N`: the part of this force that was last commanded and held since; `wanted_N`: the next
  /// force; `stored_J`: recoverable energy in the spring between handle and end effector.
  Output step(const Eigen::Vector3d& p_m, const Eigen::Vector3d& v_m_per_s, const Eigen::Vector3d& held_N,
              const Eigen::Vector3d& wanted_N, double stored_J) noexcept;

  /// The robot has pushed the handle with energy that the hand did not supply; the handle may be released.
  /// Always false for an observer (active = false).
  bool nearly_empty() const noexcept { return config_.active && level_J_ < 0.2 * config_.reserve_J; }
  /// Negative only by what the last cycle delivered unexpectedly.
  double level_J() const noexcept { return level_J_; }

 private:
  Config config_;
  bool has_sample_ = false;
  Eigen::Vector3d p_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d damper_N_ = Eigen::Vector3d::Zero();  // part of the held force
  double level_J_;
};

struct LimitedForce {
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();   ///< next force, with the damper
  Eigen::Vector3d damper_N = Eigen::Vector3d::Zero();  ///< part of it
  double withheld_N = 0.0;                             ///< wanted minus commanded force, without the damper
};
/// The force that an EnergyTank with this level passes: `config.active` does not count. Cycle.
LimitedForce limited_by_energy(const EnergyTank::Config& config, double level_J,
                               const Eigen::Vector3d& v_m_per_s, const Eigen::Vector3d& wanted_N) noexcept;

}  // namespace control
