#include "apps/youbot_bench/arm_tour.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace youbot_bench {
namespace {

using control::ArmVector;

/// Largest speed and acceleration of 10·x³ − 15·x⁴ + 6·x⁵ within its unit of time.
constexpr double kPeakSpeed = 1.875;
constexpr double kPeakAcceleration = 5.7735;

double line_s(const ArmVector& from_rad, const ArmVector& to_rad) {
  const double longest_rad = (to_rad - from_rad).cwiseAbs().maxCoeff();
  return std::max(kPeakSpeed * longest_rad / ArmTour::kSpeed_rad_per_s,
                  std::sqrt(kPeakAcceleration * longest_rad / ArmTour::kAcceleration_rad_per_s2));
}

}  // namespace

ArmTour::ArmTour(std::vector<identification::experiments::FourierMotion> motions, const ArmVector& ready_rad)
    : motions_(std::move(motions)) {
  const auto line = [this](const ArmVector& to_rad) {
    const ArmVector from_rad = parts_.empty() ? to_rad : parts_.back().to_rad;
    parts_.push_back({.from_rad = from_rad, .to_rad = to_rad});
  };
  line(ready_rad);  // from the start, which is set later
  for (std::size_t m = 0; m < motions_.size(); ++m) {
    const ArmVector centre_rad = motions_[m].centre_rad;
    line(centre_rad);
    parts_.push_back({.motion = static_cast<int>(m), .from_rad = centre_rad, .to_rad = centre_rad});
  }
  line(ready_rad);
  line(ready_rad);  // to the start
  start_at(ready_rad);
}

void ArmTour::start_at(const ArmVector& start_rad) noexcept {
  parts_.front().from_rad = start_rad;
  parts_.back().to_rad = start_rad;
  double begin_s = 0;
  for (Part& part : parts_) {
    part.begin_s = begin_s;
    part.duration_s = part.motion < 0 ? line_s(part.from_rad, part.to_rad)
                                      : motions_[static_cast<std::size_t>(part.motion)].duration_s;
    begin_s += part.duration_s;
  }
}

ArmTour::State ArmTour::at(double time_s) const noexcept {
  auto part = parts_.begin();
  while (part + 1 != parts_.end() && time_s >= part->begin_s + part->duration_s) ++part;
  State state;
  state.time_s = time_s - part->begin_s;
  if (part->motion >= 0) {
    state.motion = part->motion;
    for (Eigen::Index j = 0; j < control::kArmJoints; ++j) {
      const auto joint = motions_[static_cast<std::size_t>(part->motion)].at(j, state.time_s);
      state.position_rad[j] = joint.position_rad;
      state.velocity_rad_per_s[j] = joint.velocity_rad_per_s;
    }
    return state;
  }
  const double x = part->duration_s > 0 ? std::clamp(state.time_s / part->duration_s, 0.0, 1.0) : 1.0;
  const ArmVector way_rad = part->to_rad - part->from_rad;
  state.position_rad = part->from_rad + x * x * x * (10 + x * (6 * x - 15)) * way_rad;
  state.velocity_rad_per_s.setZero();
  if (part->duration_s > 0)
    state.velocity_rad_per_s = 30 * x * x * (x - 1) * (x - 1) / part->duration_s * way_rad;
  return state;
}

}  // namespace youbot_bench
