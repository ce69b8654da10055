/// @file
/// A path of the base as a function of time, planned before the motion and evaluated in the cycle.
#pragma once
#include <vector>

#include "control/planar.h"

namespace control {

/// Pose of the base, its twist and acceleration, in the fixed frame W.
struct BaseReference {
  PlanarPose X_WB;
  PlanarVector twist_W = PlanarVector::Zero();
  PlanarVector acceleration_W = PlanarVector::Zero();
};

/// Straight lines, turns and circular arcs (each a displacement at constant body twist, see moved_by), driven
/// one after the other with a rest between. The distance along each follows the fifth-order polynomial s(τ) =
/// 10τ³ − 15τ⁴ + 6τ⁵, which starts and ends at rest without a step in force. Its duration is the shortest (to
/// a millionth) that keeps all limits, including the centripetal acceleration of arcs.
class BasePath {
 public:
  struct Limits {
    double speed_m_per_s = 0.10;
    double acceleration_m_per_s2 = 0.04;
    double turn_speed_rad_per_s = 0.15;
    double turn_acceleration_rad_per_s2 = 0.04;
  };
  struct Plan {
    PlanarPose start;
    std::vector<PlanarVector> displacements_B;  ///< each in the base frame at its own start
    double rest_s = 1.0;                        ///< before each displacement
    Limits limits;
  };

  /// Setup. @throws std::invalid_argument naming the value that is not finite or not positive.
  explicit BasePath(const Plan& plan);

  /// Cycle. Before the start and after the end, the reference is at rest there.
  BaseReference at(double time_s) const noexcept;
  double duration_s() const noexcept { return duration_s_; }
  /// End of the path.
  const PlanarPose& goal() const noexcept { return goal_; }

 private:
  struct Segment {
    PlanarPose start;
    PlanarVector displacement_B;
    double begin_s;
    double duration_s;
  };
  std::vector<Segment> segments_;
  PlanarPose goal_;
  double duration_s_ = 0.0;
};

}  // namespace control
