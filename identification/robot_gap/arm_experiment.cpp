#include "identification/robot_gap/arm_experiment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>

#include "identification/robot_gap/arm_rows.h"

namespace identification::robot_gap {
namespace {

constexpr int kPoses = 2000;
constexpr int kPoseBins = 6;
/// Difference in noise floors that shows in a single row.
constexpr double kShows = 1;

struct Range {
  double lower = 0;
  double upper = 0;
};
Range range_of(std::span<const ArmMotion> motions, Eigen::Index joint) {
  Range range{motions.front().position_rad(joint, 0), motions.front().position_rad(joint, 0)};
  for (const ArmMotion& motion : motions) {
    range.lower = std::min(range.lower, motion.position_rad.row(joint).minCoeff());
    range.upper = std::max(range.upper, motion.position_rad.row(joint).maxCoeff());
  }
  return range;
}

double rms_row(std::span<const ArmMotion> motions, Eigen::Index joint, Eigen::MatrixXd ArmMotion::*quantity) {
  double sum = 0;
  double count = 0;
  for (const ArmMotion& motion : motions) {
    sum += (motion.*quantity).row(joint).squaredNorm();
    count += static_cast<double>((motion.*quantity).cols());
  }
  return std::sqrt(sum / std::max(1.0, count));
}

/// Random states as if they were a motion.
ArmMotion random_states(std::span<const ArmMotion> motions, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Eigen::Index joints = motions.front().position_rad.rows();
  ArmMotion states;
  states.is_scattered = true;
  states.position_rad.resize(joints, kPoses);
  states.velocity_rad_per_s.resize(joints, kPoses);
  states.acceleration_rad_per_s2.resize(joints, kPoses);
  for (Eigen::Index j = 0; j < joints; ++j) {
    const Range range = range_of(motions, j);
    const double centre = 0.5 * (range.lower + range.upper);
    const double half = range.upper - range.lower;  // half of it beyond either end
    const double v = rms_row(motions, j, &ArmMotion::velocity_rad_per_s);
    const double a = rms_row(motions, j, &ArmMotion::acceleration_rad_per_s2);
    for (Eigen::Index i = 0; i < kPoses; ++i) {
      states.position_rad(j, i) = centre + half * uniform(random);
      states.velocity_rad_per_s(j, i) = std::sqrt(3.0) * v * uniform(random);
      states.acceleration_rad_per_s2(j, i) = std::sqrt(3.0) * a * uniform(random);
    }
  }
  return states;
}

}  // namespace

std::string deciding_pose(const control::ArmDescription& one, const control::ArmDescription& other,
                          std::span<const ArmMotion> motions, const Eigen::VectorXd& floor_Nm,
                          std::uint64_t seed) {
  ArmMotion states = random_states(motions, seed);
  control::ArmDescription stiff = one;
  for (control::ArmDrive& drive : stiff.drives) drive.compliance_rad_per_Nm = 0;
  states.torque_Nm = predicted_torque_Nm(stiff, states);
  const Eigen::MatrixXd difference = floor_Nm.cwiseInverse().asDiagonal() *
                                     (predicted_torque_Nm(one, states) - predicted_torque_Nm(other, states));
  const Eigen::VectorXd squares = difference.colwise().squaredNorm().transpose();
  double most = -1;
  Eigen::Index best_joint = 0;
  Range best;
  for (Eigen::Index j = 0; j < difference.rows(); ++j) {
    const Range seen = range_of(motions, j);
    const double width = 2 * (seen.upper - seen.lower) / kPoseBins;
    if (!(width > 0)) continue;
    const double from = seen.lower - (seen.upper - seen.lower) / 2;
    std::array<double, kPoseBins> sum{};
    std::array<double, kPoseBins> count{};
    for (Eigen::Index i = 0; i < kPoses; ++i) {
      const auto bin = static_cast<std::size_t>(
          std::clamp((states.position_rad(j, i) - from) / width, 0.0, kPoseBins - 1.0));
      sum[bin] += squares[i];
      ++count[bin];
    }
    for (std::size_t b = 0; b < kPoseBins; ++b) {
      const double mean = count[b] > 0 ? sum[b] / count[b] : 0;
      if (mean <= most) continue;
      most = mean;
      best_joint = j;
      best = {from + static_cast<double>(b) * width, from + static_cast<double>(b + 1) * width};
    }
  }
  const double sigmas = std::sqrt(std::max(0.0, most));
  if (sigmas < kShows)
    return "none: in no pose of twice the range that was driven do the two differ by more than the noise";
  Eigen::Index seen_at = 0;
  difference.cwiseAbs().rowwise().mean().maxCoeff(&seen_at);
  std::array<char, 300> text{};
  std::snprintf(text.data(), text.size(),
                "move %s between %.2f and %.2f rad, the others as before: the two models then differ by %.1f "
                "noise floors, most of it in the torque of %s",
                one.arm.links[static_cast<std::size_t>(best_joint)].joint.c_str(), best.lower, best.upper,
                sigmas, one.arm.links[static_cast<std::size_t>(seen_at)].joint.c_str());
  return text.data();
}

}  // namespace identification::robot_gap
