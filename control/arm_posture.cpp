#include "control/arm_posture.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "control/planar.h"

namespace control {

std::optional<ArmVector> arm_posture_for(const TipPose& pose, const ArmVector& seed_rad, RobotModel& model) {
  constexpr int kIterations = 500;
  constexpr double kDamping = 1e-3;
  constexpr double kLargestStep_rad = 0.1;
  ArmVector position_rad = seed_rad;
  for (int n = 0; n < kIterations; ++n) {
    model.update((ChainVector() << PlanarVector::Zero(), position_rad).finished());
    Wrench error;  // a displacement: [m, rad]
    error << pose.p_WT_m - model.X_WT().translation(),
        rotation_between(Eigen::Quaterniond(model.X_WT().linear()), pose.q_WT);
    if (error.head<3>().norm() < 1e-4 && error.tail<3>().norm() < 1e-4) return position_rad;

    const Eigen::Matrix<double, 6, kArmJoints> jacobian = model.J_WT().rightCols<kArmJoints>();
    Eigen::Matrix<double, kArmJoints, kArmJoints> normal = jacobian.transpose() * jacobian;
    normal.diagonal().array() += kDamping;
    ArmVector step_rad = normal.ldlt().solve(jacobian.transpose() * error);
    const double largest_rad = step_rad.cwiseAbs().maxCoeff();
    if (largest_rad > kLargestStep_rad) step_rad *= kLargestStep_rad / largest_rad;
    for (int i = 0; i < kArmJoints; ++i) {
      const JointRange& range = model.ranges()[static_cast<std::size_t>(i)];
      position_rad[i] = std::clamp(position_rad[i] + step_rad[i], range.lower_rad, range.upper_rad);
    }
  }
  return std::nullopt;
}

}  // namespace control
