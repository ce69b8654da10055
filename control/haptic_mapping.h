/// @file
/// From the grip in the hand to where the robot's tip should be, and from the force on the tip to that on the
/// hand (thesis 3.4.1 and 3.4.3).
///
/// Frames: H and D as in hal/haptic_sample.h (x towards the operator, y to his right, z up), W and T as in
/// control/robot_model.h (x forward, y left, z up). The operator looks along W's x, so x and y change sign
/// between H and W.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "control/rate_boundary.h"
#include "control/tip_pose.h"

namespace control {

struct Grip {
  Eigen::Vector3d p_HD_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_HD = Eigen::Quaterniond::Identity();
  Eigen::Vector3d v_HD_H_m_per_s = Eigen::Vector3d::Zero();
};

/// Inside the boundary the tip follows the grip: p = s·R_WH·h + o. Outside it moves at constant speed in the
/// direction of the grip from the master's origin, and when the grip comes back the offset o has taken up how
/// far it went, so that the target goes on from where it is. The rotation follows the grip's since the last
/// index. After an index nothing is driven before the grip was inside the boundary, or a rate-only master for
/// 0.2 s at rest: one that is held deflected meanwhile has not yet told anything, nor has one that has passed
/// its middle or has not told where it is since it was opened. One thread. Cycle: index(), step().
class HapticMapping {
 public:
  enum class Mode { kPosition, kRate };
  struct Config {
    double period_s = 1e-3;
    double motion_scale = 1.0;  ///< s, tip over grip
    bool follow_rotation = true;
    /// The master springs back to its middle: it tells nothing but speeds.
    bool rate_only = false;
    RateBoundary boundary;
    double rate_speed_m_per_s = 0.1;  ///< the thesis has 1 m/s
    /// Under rate control the target waits for a tip that is further behind than this, so that a robot that
    /// is held up winds the spring no further.
    double leash_m = 0.012;
    double turn_leash_rad = 0.10472;  ///< likewise one that is turned behind; less than half a turn
    /// Of a rate-only master: no speed up to here, all of it from there on; likewise turning.
    double rest_deflection_m = 0.005;
    double full_deflection_m = 0.050;
    double rest_turn_rad = 0.05236;
    double full_turn_rad = 0.5236;
    double rate_turn_rad_per_s = 0.17453;
  };

  /// @throws std::invalid_argument naming the value out of range; also when the master's origin is not inside
  /// the boundary, as rate control would have no direction there.
  explicit HapticMapping(const Config& config);

  /// From here on the grip where it is means this pose: for the start, and after the clutch.
  void index(const Grip& grip, const TipPose& target) noexcept;
  /// One cycle. `tip`: where it is. `may_drive`: otherwise nothing moves by rate control. `fresh`: the grip
  /// is no old one, which would tell no rest.
  const TipPose& step(const Grip& grip, const TipPose& tip, bool may_drive = true,
                      bool fresh = true) noexcept;

  const TipPose& target() const noexcept { return target_; }
  Mode mode() const noexcept { return mode_; }

 private:
  void advance(const Eigen::Vector3d& velocity_W_m_per_s, const Eigen::Vector3d& p_WT_m) noexcept;
  void turn(const Eigen::Vector3d& velocity_W_rad_per_s, const Eigen::Quaterniond& q_WT) noexcept;
  void follow_deflection(const Grip& grip, const TipPose& tip, bool may_drive, bool fresh) noexcept;

  Config config_;
  Mode mode_ = Mode::kPosition;
  bool been_inside_ = false;  // or at rest, since the index: before that nothing is driven
  double at_rest_s_ = 0;      // of a rate-only master, in fresh samples without a break
  TipPose target_;
  Eigen::Vector3d offset_W_m_ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_HD_index_ = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond q_WT_index_ = Eigen::Quaterniond::Identity();
};

}  // namespace control
