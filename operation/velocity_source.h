/// @file
/// Set-points from a repeated velocity command.
#pragma once
#include "control/base_path.h"
#include "control/link_map.h"
#include "control/workspace.h"
#include "hal/newest_value.h"
#include "operation/motion_source.h"

namespace operation {

/// A reference that moves at the last commanded velocity, within the speed and acceleration limits of the
/// path. It waits for a base that is held back, so that the base does not jump when it is released; the
/// commanding client sees this and continues. On a path, where no one does, the base is stopped instead
/// (Cycle::Config).
class VelocitySource final : public MotionSource {
 public:
  /// Maximum distance of the reference from the base.
  struct Leash {
    double m = 0.1;
    double rad = 0.2;
  };

  /// A velocity that would turn a wheel too fast is scaled down as a whole, which keeps its direction. If a
  /// turn is added to a fast drive, this may exceed the acceleration limit; the cycle's ReferenceLimiter
  /// bounds it.
  struct Wheels {
    control::LinkMap map;
    double speed_limit_rad_per_s;
  };

  /// `box_W_m`: the reference brakes before its limits as hard as allowed, and stays inside.
  VelocitySource(const control::BasePath::Limits& limits, const Wheels& wheels,
                 std::chrono::nanoseconds period, const Leash& leash, const Eigen::AlignedBox2d& box_W_m)
      : limits_(limits),
        wheels_(wheels),
        leash_(leash),
        box_W_m_(box_W_m),
        period_s_(std::chrono::duration<double>(period).count()) {}

  /// From another thread: m/s ahead and to the left, rad/s counter-clockwise; finite.
  void tell(const control::PlanarVector& twist_B) noexcept { commanded_.publish(twist_B); }

  void begin(std::chrono::nanoseconds now, const control::PlanarPose& X_WB) noexcept override;
  Motion read(std::chrono::nanoseconds now, const control::PlanarPose& X_WB) noexcept override;

 private:
  control::PlanarVector slow_enough_for_wheels(const control::PlanarVector& twist_B) const noexcept;
  /// Limits the speed towards a workspace limit so that it can brake before it.
  control::PlanarVector braked_before_walls(const control::PlanarVector& twist_B) const noexcept;

  control::BasePath::Limits limits_;
  Wheels wheels_;
  Leash leash_;
  Eigen::AlignedBox2d box_W_m_;
  double period_s_;
  hal::NewestValue<control::PlanarVector> commanded_;
  control::PlanarVector wanted_B_ = control::PlanarVector::Zero();
  control::PlanarVector twist_B_ = control::PlanarVector::Zero();  // of the reference
  control::PlanarPose reference_W_;
  std::chrono::nanoseconds last_read_{};
};

}  // namespace operation
