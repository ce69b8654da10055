/// @file
/// Passivity of a link with delay between the hand's station and the robot's: time-domain passivity of a
/// two-port (Ryu, Artigas and Preusche, "A passive bilateral control scheme for a teleoperator with
/// time-varying communication delay", Mechatronics 20:7, 2010).
///
/// The positions of the handle go to the robot and the forces on it come back, both late, so that the link
/// may return more energy than it received. Each port therefore counts the energy that enters the link at it,
/// E_in, and the other port, which receives that number as late as everything else, lets no more leave:
///   energy that leaves at a port(t) ≤ E_in of the other port(t - delay) + reserve
/// Then the sum over both ports never falls below two reserves, however long and variable the delay is, and
/// whatever is lost: E_in never falls. Without delay both ports are transparent.
///
/// Force: on the hand, in H. Position: of the handle, in H.
#pragma once
#include <Eigen/Core>

#include "control/energy_tank.h"

namespace control {

struct DelayedPortConfig {
  /// For the hand's port, whose force the tank limits; its reserve also bounds the robot's port.
  EnergyTank::Config tank{.reserve_J = 0.02};
  /// Energy that the other port sent and that was not needed is forgotten beyond this: it was lost on the
  /// way.
  double surplus_J = 0.1;
  bool active = true;  ///< false: counts only
};

/// What has passed a port. One thread. Cycle: everything.
class PortLedger {
 public:
  PortLedger(double reserve_J, double surplus_J) : reserve_J_(reserve_J), surplus_J_(surplus_J) {}

  /// `leaving_J`: out of the link; negative: into it.
  void count(double leaving_J) noexcept {
    if (leaving_J > 0)
      out_J_ += leaving_J;
    else
      in_J_ -= leaving_J;
  }
  /// Energy that may leave now. `other_in_J`: the other port's in_J(), as received last.
  double level_J(double other_in_J) noexcept {
    const double level_J = reserve_J_ + other_in_J - out_J_ - forgotten_J_;
    const double excess_J = level_J - (reserve_J_ + surplus_J_);
    if (excess_J <= 0) return level_J;
    forgotten_J_ += excess_J;
    return reserve_J_ + surplus_J_;
  }
  double in_J() const noexcept { return in_J_; }    ///< never falls
  double out_J() const noexcept { return out_J_; }  ///< never falls

 private:
  double reserve_J_;
  double surplus_J_;
  double in_J_ = 0.0;
  double out_J_ = 0.0;
  double forgotten_J_ = 0.0;
};

/// At the hand: limits the force as an EnergyTank with the level of the ledger does. One thread. Cycle: all
/// but construction.
class HandPort {
 public:
  /// @throws std::invalid_argument naming the value out of range.
  explicit HandPort(const DelayedPortConfig& config);

  void reset() noexcept;
  /// One cycle. `held_N`: the force that acted on the hand since the last one; `wanted_N`: as received.
  Eigen::Vector3d step(const Eigen::Vector3d& p_m, const Eigen::Vector3d& v_m_per_s,
                       const Eigen::Vector3d& held_N, const Eigen::Vector3d& wanted_N,
                       double robot_in_J) noexcept;

  const PortLedger& ledger() const noexcept { return ledger_; }
  double withheld_N() const noexcept { return withheld_N_; }  ///< in the last cycle

 private:
  DelayedPortConfig config_;
  PortLedger ledger_;
  bool has_sample_ = false;
  Eigen::Vector3d p_m_ = Eigen::Vector3d::Zero();
  double withheld_N_ = 0.0;
};

/// At the robot: follows the received position as far as the energy allows, and no faster than `most_m` in a
/// cycle. Motion across the force, or with it, is free. What is missing of the way is made up for when energy
/// arrives or the force falls, so that no offset remains. One thread. Cycle: all but construction.
class RobotPort {
 public:
  explicit RobotPort(const DelayedPortConfig& config);

  /// The next position is taken as it is.
  void reset() noexcept;
  /// One cycle: the position for the robot. `held_N`: the robot's force on the hand since the last one.
  Eigen::Vector3d step(const Eigen::Vector3d& received_m, const Eigen::Vector3d& held_N, double hand_in_J,
                       double most_m) noexcept;

  const PortLedger& ledger() const noexcept { return ledger_; }

 private:
  DelayedPortConfig config_;
  PortLedger ledger_;
  bool has_position_ = false;
  Eigen::Vector3d p_m_ = Eigen::Vector3d::Zero();
};

}  // namespace control
