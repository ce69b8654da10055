/// @file
/// Keeps a master from giving the hand more energy than it got from it: passivity observer and controller
/// (Hannaford and Ryu, IEEE Trans. Robotics and Automation 18:1, 2002) with an energy tank.
#pragma once
#include <Eigen/Core>

namespace control {

/// The tank holds what the hand has put in, and at most what the coupling's spring stores now, plus a small
/// reserve. So energy that the robot puts into the spring by moving on its own, as it does when only the
/// pen's orientation changes, is never there to be given away, while a spring that the hand has wound up
/// gives back all of it. As the tank runs empty the force that would drain it fades out, and a damper fades
/// in; a force that the hand moves against is always let through, and refills the tank. What the damper takes
/// is lost.
///
/// A device takes a force away only at a rate R. Meanwhile a force F along the speed v of a mass m still
/// gives F²·v/(2R) + F⁴/(8·m·R²), so that no more force is given than can be braked with what is in the tank.
/// One thread. Cycle: all but construction.
class EnergyTank {
 public:
  struct Config {
    double reserve_J = 0.005;
    double damping_N_s_per_m = 3.0;     ///< of the damper, when the tank is empty
    double force_rate_N_per_s = 200.0;  ///< how fast the device can take a force away
    double device_mass_kg = 0.3;        ///< least that the force then still sets in motion
    /// A hand that moves against the force at this speed gets all of it from an empty tank.
    double against_speed_m_per_s = 0.01;
    bool active = true;  ///< false: observes only
  };
  struct Output {
    Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
    double withheld_N = 0.0;  ///< how much less than wanted, but for the damper
  };

  /// @throws std::invalid_argument naming the value out of range.
  explicit EnergyTank(const Config& config);

  /// Full with the reserve alone.
  void reset() noexcept;
  /// One cycle. `held_N`: of this force, what the device was told last and held since; `wanted_N`: what is to
  /// come; `stored_J`: in the spring between grip and tip, as the hand would get it back.
  Output step(const Eigen::Vector3d& p_m, const Eigen::Vector3d& v_m_per_s, const Eigen::Vector3d& held_N,
              const Eigen::Vector3d& wanted_N, double stored_J) noexcept;

  /// What the robot has pushed the hand with was not put in by it: somebody may have let go. An observer
  /// alone never says so.
  bool nearly_empty() const noexcept { return config_.active && level_J_ < 0.2 * config_.reserve_J; }
  /// Below zero only by what the last cycle gave away unforeseen.
  double level_J() const noexcept { return level_J_; }

 private:
  /// Largest force whose taking away gives no more than this.
  double brakeable_N(double energy_J, double along_m_per_s) const noexcept;

  Config config_;
  bool has_sample_ = false;
  Eigen::Vector3d p_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d damper_N_ = Eigen::Vector3d::Zero();  // in the force that is held
  double level_J_;
};

}  // namespace control
