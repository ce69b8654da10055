/// @file
/// Maps the handle to the set-point of the end effector, and the force on the end effector to the force on
/// the hand (thesis 3.4.1 and 3.4.3).
///
/// Frames: H and D as in hal/haptic_sample.h (x towards the operator, y to the operator's right, z up), W and
/// T as in control/robot_model.h (x forward, y left, z up). The operator looks along W's x, so x and y change
/// sign between H and W.
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

/// Inside the boundary the set-point follows the handle: p = s·R_WH·h + o. Outside it moves at constant speed
/// in the direction of the handle from the device's origin; when the handle returns, the offset o has
/// absorbed this motion, so that the set-point continues from its position. The rotation follows the handle's
/// rotation since the last index. After an index nothing is driven until the handle has been inside the
/// boundary, or a rate-only device has been at rest for 0.2 s: until then a deflected cap does not drive, nor
/// does one that passes through its centre or has not reported since it was opened. One thread. Cycle:
/// all but construction.
class HapticMapping {
 public:
  enum class Mode { kPosition, kRate };
  struct Config {
    double period_s = 1e-3;
    double motion_scale = 1.0;  ///< s, end effector over handle
    bool follow_rotation = true;
    /// Self-centring device: it commands speeds only.
    bool rate_only = false;
    RateBoundary boundary;
    double rate_speed_m_per_s = 0.1;  ///< the thesis uses 1 m/s
    /// Under rate control the set-point stops when the end effector lags by more than this, so that a blocked
    /// robot does not load the spring further.
    double leash_m = 0.012;
    double turn_leash_rad = 0.10472;  ///< likewise for rotation; less than half a turn
    /// Rate-only device: zero speed up to the rest deflection, full speed from the full deflection; likewise
    /// for rotation.
    double rest_deflection_m = 0.005;
    double full_deflection_m = 0.050;
    double rest_turn_rad = 0.05236;
    double full_turn_rad = 0.5236;
    double rate_turn_rad_per_s = 0.17453;
  };

  /// @throws std::invalid_argument naming the value out of range; also if the device's origin is not inside
  /// the boundary, where rate control would have no direction.
  explicit HapticMapping(const Config& config);

  /// From now on the handle's current pose corresponds to `target`: for the start and after the clutch.
  void index(const Grip& grip, const TipPose& target) noexcept;
  /// One cycle. `tip`: pose of the end effector. `may_drive`: if false, rate control is off. `fresh`: the
  /// sample is new; old samples do not prove rest.
  const TipPose& step(const Grip& grip, const TipPose& tip, bool may_drive = true,
                      bool fresh = true) noexcept;

  /// From the next step on. The set-point does not jump: the handle's current position, `grip`, keeps its
  /// target.
  void set_motion_scale(double scale, const Grip& grip) noexcept;
  void set_rate_speed(double speed_m_per_s) noexcept { config_.rate_speed_m_per_s = speed_m_per_s; }

  const TipPose& target() const noexcept { return target_; }
  Mode mode() const noexcept { return mode_; }

 private:
  void advance(const Eigen::Vector3d& velocity_W_m_per_s, const Eigen::Vector3d& p_WT_m) noexcept;
  void turn(const Eigen::Vector3d& velocity_W_rad_per_s, const Eigen::Quaterniond& q_WT) noexcept;
  void follow_deflection(const Grip& grip, const TipPose& tip, bool may_drive, bool fresh) noexcept;

  Config config_;
  Mode mode_ = Mode::kPosition;
  bool been_inside_ = false;  // or at rest, since the index; nothing is driven before
  double at_rest_s_ = 0;      // of a rate-only device, in consecutive fresh samples
  TipPose target_;
  Eigen::Vector3d offset_W_m_ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_HD_index_ = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond q_WT_index_ = Eigen::Quaterniond::Identity();
};

}  // namespace control
