#include "apps/youbot_bench/arm_weight.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace youbot_bench {
namespace {

/// The weight is a sum of sines of the angle: over 0.1 rad it changes by less than the model error.
constexpr double kGrid_rad = 0.1;

}  // namespace

ArmWeight::ArmWeight(std::span<const hal::JointInfo> joints, std::size_t joint) {
  const std::string& name = joints[joint].name;  // "arm-2", "arm2-2"
  const std::string arm = name.substr(0, name.find('-') + 1);
  if (!arm.starts_with("arm")) return;
  std::array<std::size_t, control::kArmJoints> indices{};
  std::size_t own = 0;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const auto found = std::ranges::find(joints, arm + std::to_string(i + 1), &hal::JointInfo::name);
    if (found == joints.end()) return;  // one joint on a bench
    indices[i] = static_cast<std::size_t>(found - joints.begin());
    if (indices[i] == joint) own = i;
  }
  arm_.emplace(Arm{control::RobotModel(), indices, static_cast<Eigen::Index>(own)});
}

int ArmWeight::first_not_homed(const hal::RobotSample& sample) const noexcept {
  if (!arm_) return -1;
  const auto first =
      std::ranges::find_if(arm_->indices, [&](std::size_t index) { return !sample.joints[index].homed; });
  return first == arm_->indices.end() ? -1 : static_cast<int>(*first);
}

double ArmWeight::heaviest_Nm(const hal::RobotSample& sample, double from_rad, double to_rad) noexcept {
  if (!arm_) return 0.0;
  control::ChainVector q = control::ChainVector::Zero();
  for (std::size_t i = 0; i < arm_->indices.size(); ++i)
    q[static_cast<Eigen::Index>(control::kBaseAxes + i)] = sample.joints[arm_->indices[i]].position_rad;
  const Eigen::Index axis = control::kBaseAxes + arm_->joint;
  const int steps = 1 + static_cast<int>(std::abs(to_rad - from_rad) / kGrid_rad);
  double heaviest_Nm = 0.0;
  for (int i = 0; i <= steps; ++i) {
    q[axis] = from_rad + (to_rad - from_rad) * i / steps;
    arm_->model.update(q);
    heaviest_Nm = std::max(heaviest_Nm, std::abs(arm_->model.gravity_Nm()[axis]));
  }
  return heaviest_Nm;
}

}  // namespace youbot_bench
