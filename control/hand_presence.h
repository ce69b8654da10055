/// @file
/// Detects whether a hand holds the handle, from the handle's motion under the commanded force.
#pragma once
#include <Eigen/Core>

namespace control {

/// A free handle obeys m·dv/dt = f − d·v. The force of the hand is the remainder, estimated by a momentum
/// observer with bandwidth ω, without differentiating the velocity:
///   r = ω·(m·v − ∫(f − d·v + r) dt).
/// If the commanded force is above the detection threshold and r is a small fraction of it, the handle is
/// assumed released. It counts as released once the impulse of the device in this state would have
/// accelerated a free handle: this takes some hundredths of a second with a large force, tenths with a small
/// one, because a hand may yield to a small force for a while. Without a force the state cannot be observed
/// and does not change; nothing pushes the handle then. One thread. Cycle: all but construction.
class HandPresence {
 public:
  struct Config {
    double period_s = 1e-3;
    double device_mass_kg = 0.3;  ///< mass of the handle alone
    double device_drag_N_s_per_m = 0.5;
    double bandwidth_rad_per_s = 60.0;
    double telling_force_N = 0.3;  ///< detection threshold of the device's force
    double released_share = 0.3;   ///< maximum hand force of a released handle, relative to the device's
                                   ///< force
    double released_impulse_N_s = 0.1;
    double felt_hand_N = 0.1;     ///< a smaller hand force counts as none while a force is withheld ...
    double unfelt_after_s = 0.3;  ///< ... for this time
  };

  /// @throws std::invalid_argument naming the value out of range.
  explicit HandPresence(const Config& config);

  /// State: hand present, handle at rest.
  void reset() noexcept;
  /// One cycle; `held_N`: the force commanded last and held since; `withheld_N`: by how much it was reduced.
  /// Returns true while a hand is present.
  bool step(const Eigen::Vector3d& v_m_per_s, const Eigen::Vector3d& held_N, double withheld_N) noexcept;
  /// Replaces step() for the first velocity after a gap in time: the change of speed during the gap is not
  /// the effect of one period's force, so it is ignored.
  bool bridge(const Eigen::Vector3d& v_m_per_s) noexcept {
    expected_N_s_ = config_.device_mass_kg * v_m_per_s - hand_N_ / config_.bandwidth_rad_per_s;
    return present_;
  }

  /// On the handle, low-passed.
  const Eigen::Vector3d& hand_force_N() const noexcept { return hand_N_; }

 private:
  Config config_;
  Eigen::Vector3d expected_N_s_ = Eigen::Vector3d::Zero();  // momentum of a free handle, corrected
  Eigen::Vector3d hand_N_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d device_N_ = Eigen::Vector3d::Zero();  // low-passed with the same bandwidth
  double unopposed_N_s_ = 0.0;
  double unfelt_s_ = 0.0;
  bool present_ = true;
};

}  // namespace control
