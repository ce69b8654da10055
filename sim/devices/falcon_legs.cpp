#include "sim/devices/falcon_legs.h"

#include <cmath>
#include <cstddef>

namespace sim::devices {
namespace {

struct Dimensions {
  double thigh = 0.060, shin = 0.1025, grip_offset = 0.01443, knee = 0.01125, ankle = 0.01125;
  double grip_side = -0.025, base_radius = 0.040, base_side = -0.02309;
};
constexpr Dimensions kLeg;
constexpr double kDegree = 0.017453292519943295;
constexpr FalconVector kAzimuths_deg{90.0 + 15.0, -30.0 + 15.0, -150.0 + 15.0};

// The knee moves on a circle of radius `thigh` about the origin; the end of the leg at (x, z) has the
// distance `shin` from it:
//   2 thigh x cos + 2 thigh z sin = thigh^2 + x^2 + z^2 - shin^2 = k.
// With t = tan(theta / 2): (k + 2 thigh x) t^2 - 4 thigh z t + (k - 2 thigh x) = 0; the solution has the knee
// on the outer side of the line from the origin to the end.
double thigh_angle_rad(double azimuth_deg, const FalconVector& grip) noexcept {
  const double c = std::cos(azimuth_deg * kDegree);
  const double s = std::sin(azimuth_deg * kDegree);
  const double x = c * grip[0] + s * grip[1] - kLeg.base_radius + kLeg.grip_offset;
  const double side = -s * grip[0] + c * grip[1] - kLeg.base_side + kLeg.grip_side;
  const double z = grip[2];
  const double shin =
      kLeg.knee + kLeg.ankle + std::sqrt(kLeg.shin * kLeg.shin - side * side);  // in the leg's plane
  const double k = kLeg.thigh * kLeg.thigh + x * x + z * z - shin * shin;
  const double quadratic = k + 2 * kLeg.thigh * x;
  const double constant = k - 2 * kLeg.thigh * x;
  const double half_linear = -2 * kLeg.thigh * z;
  const double root = std::sqrt(half_linear * half_linear - quadratic * constant);
  for (const double sign : {-1.0, 1.0}) {
    const double theta = std::remainder(2 * std::atan2(-half_linear + sign * root, quadratic), 360 * kDegree);
    if (z * std::cos(theta) - x * std::sin(theta) > 0) return theta;
  }
  return NAN;
}

}  // namespace

FalconVector falcon_thigh_angles_rad(const FalconVector& grip_m) noexcept {
  FalconVector angles{};
  for (std::size_t leg = 0; leg < 3; ++leg) angles[leg] = thigh_angle_rad(kAzimuths_deg[leg], grip_m);
  return angles;
}

FalconVector falcon_force_N(const FalconVector& grip_m, const FalconVector& torques_Nm) noexcept {
  constexpr double kStep_m = 1e-6;
  FalconVector force{};
  for (std::size_t k = 0; k < 3; ++k) {
    FalconVector ahead = grip_m;
    FalconVector behind = grip_m;
    ahead[k] += kStep_m;
    behind[k] -= kStep_m;
    const FalconVector more = falcon_thigh_angles_rad(ahead);
    const FalconVector less = falcon_thigh_angles_rad(behind);
    for (std::size_t leg = 0; leg < 3; ++leg) {
      force[k] += torques_Nm[leg] * (more[leg] - less[leg]) / (2 * kStep_m);
    }
  }
  return force;
}

}  // namespace sim::devices
