/// @file
/// Set-points from a velocity that somebody keeps telling.
#pragma once
#include "control/base_path.h"
#include "control/link_map.h"
#include "control/workspace.h"
#include "hal/newest_value.h"
#include "operation/motion_source.h"

namespace operation {

/// A reference that moves at the last commanded velocity, no faster and no more suddenly than the limits of
/// the path allow. It waits for a base that is held back, so that it does not dart off when it is let go; who
/// commands a velocity sees that, and goes on. A path has no commander who sees it, and is stopped
/// (Cycle::Config).
class VelocitySource final : public MotionSource {
 public:
  /// The reference is never further from the base than this.
  struct Leash {
    double m = 0.1;
    double rad = 0.2;
  };

  /// What would turn a wheel faster is slowed down as a whole, so that its direction stays; where a turn adds
  /// to a fast drive, harder than the acceleration allows, which the cycle's ReferenceLimiter bounds.
  struct Wheels {
    control::LinkMap map;
    double speed_limit_rad_per_s;
  };

  /// `box_W_m`: the reference brakes before its walls as hard as the limits allow, and stays inside.
  VelocitySource(const control::BasePath::Limits& limits, const Wheels& wheels,
                 std::chrono::nanoseconds period, const Leash& leash, const Eigen::AlignedBox2d& box_W_m)
      : limits_(limits),
        wheels_(wheels),
        leash_(leash),
        box_W_m_(box_W_m),
        period_s_(std::chrono::duration<double>(period).count()) {}

  /// From another thread: m/s ahead and to the left, rad/s counter-clockwise; finite.
  void tell(const control::PlanarVector& twist_B) noexcept { told_.publish(twist_B); }

  void begin(std::chrono::nanoseconds now, const control::PlanarPose& X_WB) noexcept override;
  Motion read(std::chrono::nanoseconds now, const control::PlanarPose& X_WB) noexcept override;

 private:
  control::PlanarVector slow_enough_for_wheels(const control::PlanarVector& twist_B) const noexcept;
  /// No faster towards a wall than it can be braked before it.
  control::PlanarVector braked_before_walls(const control::PlanarVector& twist_B) const noexcept;

  control::BasePath::Limits limits_;
  Wheels wheels_;
  Leash leash_;
  Eigen::AlignedBox2d box_W_m_;
  double period_s_;
  hal::NewestValue<control::PlanarVector> told_;
  control::PlanarVector wanted_B_ = control::PlanarVector::Zero();
  control::PlanarVector twist_B_ = control::PlanarVector::Zero();  // of the reference
  control::PlanarPose reference_W_;
  std::chrono::nanoseconds last_read_{};
};

}  // namespace operation
