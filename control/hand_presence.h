/// @file
/// Whether a hand holds the grip, from how the grip moves under the force that it is given.
#pragma once
#include <Eigen/Core>

namespace control {

/// A grip alone obeys m·dv/dt = f − d·v. The force of the hand is what is missing there, as an observer of
/// the momentum sees it, low-passed with a bandwidth ω and without differencing a velocity:
///   r = ω·(m·v − ∫(f − d·v + r) dt).
/// While the device pushes with a force that can be told from nothing, and r is but a small share of it,
/// nobody seems to hold the grip. When the impulse of the device meanwhile is one that would have made a grip
/// of its mass fly, nobody does: a large force tells within some hundredths of a second, a small one takes
/// tenths, as a hand may go along with a small force for a while. Without a force nothing can be told, and
/// nothing is changed: then nothing pushes the grip either. One thread. Cycle: all but construction.
class HandPresence {
 public:
  struct Config {
    double period_s = 1e-3;
    double device_mass_kg = 0.3;  ///< what the grip alone feels like
    double device_drag_N_s_per_m = 0.5;
    double bandwidth_rad_per_s = 60.0;
    double telling_force_N = 0.3;  ///< smaller ones tell nothing
    double released_share = 0.3;   ///< of the device's force that the hand holds against
    double released_impulse_N_s = 0.1;
    double felt_hand_N = 0.1;     ///< less is none, while a force is withheld ...
    double unfelt_after_s = 0.3;  ///< ... for so long
  };

  /// @throws std::invalid_argument naming the value out of range.
  explicit HandPresence(const Config& config);

  /// A hand is there, and the grip at rest.
  void reset() noexcept;
  /// One cycle; `held_N` is what the device was told last and held since, `withheld_N` how much more it was
  /// to have. True while a hand is there.
  bool step(const Eigen::Vector3d& v_m_per_s, const Eigen::Vector3d& held_N, double withheld_N) noexcept;
  /// Instead of the step with this velocity after a gap in time: what the grip's speed has changed by
  /// meanwhile is no force of one period, and tells nothing.
  bool bridge(const Eigen::Vector3d& v_m_per_s) noexcept {
    expected_N_s_ = config_.device_mass_kg * v_m_per_s - hand_N_ / config_.bandwidth_rad_per_s;
    return present_;
  }

  /// On the grip, low-passed.
  const Eigen::Vector3d& hand_force_N() const noexcept { return hand_N_; }

 private:
  Config config_;
  Eigen::Vector3d expected_N_s_ = Eigen::Vector3d::Zero();  // momentum of a grip without a hand, corrected
  Eigen::Vector3d hand_N_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d device_N_ = Eigen::Vector3d::Zero();  // low-passed alike
  double unopposed_N_s_ = 0.0;
  double unfelt_s_ = 0.0;
  bool present_ = true;
};

}  // namespace control
