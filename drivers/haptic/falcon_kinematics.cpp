#include "drivers/haptic/falcon_kinematics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace drivers::haptic::falcon {
namespace {

// Metres; the letters are Stamper's.
constexpr double kA = 0.060;     // thigh
constexpr double kB = 0.1025;    // shin: the long sides of its parallelogram
constexpr double kC = 0.01443;   // grip's centre to the ends of the legs
constexpr double kD = 0.01125;   // knee: thigh to parallelogram
constexpr double kE = 0.01125;   // ankle: parallelogram to grip
constexpr double kF = -0.025;    // sideways, from the thigh's plane to the end of the leg
constexpr double kR = 0.040;     // base's centre to the thighs' axes
constexpr double kS = -0.02309;  // sideways, of the thigh

constexpr double kDegree = kPi / 180.0;
constexpr Vector3 kAzimuth_rad{105.0 * kDegree, -15.0 * kDegree, -135.0 * kDegree};

constexpr double kTolerance_rad = 1e-9;
constexpr int kMaxIterations = 30;
constexpr int kMaxHalvings = 12;

/// One leg, its plane of motion spanned by "outwards" and z.
struct Leg {
  double cos_azimuth, sin_azimuth;
  double outwards, z;  // grip's end of the leg, seen from the thigh's axis
  double length;       // L
  double cot_shin;     // of theta3
  double theta;
};

std::optional<Leg> leg(std::size_t i, const Vector3& p) noexcept {
  const double cos_azimuth = std::cos(kAzimuth_rad[i]);
  const double sin_azimuth = std::sin(kAzimuth_rad[i]);
  const double outwards = p[0] * cos_azimuth + p[1] * sin_azimuth - kR + kC;
  const double sideways = -p[0] * sin_azimuth + p[1] * cos_azimuth - kS;
  const double z = p[2];

  const double cos_shin = (sideways + kF) / kB;
  const double sin_shin_squared = 1.0 - cos_shin * cos_shin;
  if (!(sin_shin_squared > 0.0)) return std::nullopt;  // NaN, too
  const double sin_shin = std::sqrt(sin_shin_squared);
  const double length = kD + kE + kB * sin_shin;

  const double reach = std::hypot(outwards, z);
  const double cos_knee = (kA * kA + reach * reach - length * length) / (2.0 * kA * reach);
  if (!(std::abs(cos_knee) <= 1.0)) return std::nullopt;
  // Near z = 0 the sum leaves ±180°; the thigh is not there, but a step of Newton's may be.
  const double theta = std::remainder(std::atan2(z, outwards) - std::acos(cos_knee), 2.0 * kPi);
  return Leg{cos_azimuth, sin_azimuth, outwards, z, length, cos_shin / sin_shin, theta};
}

/// Solves m x = right side, by Cramer's rule. Nothing when m is singular up to rounding.
std::optional<Vector3> solve(const Matrix3& m, const Vector3& right) noexcept {
  const auto cross = [](const Vector3& a, const Vector3& b) {
    return Vector3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto dot = [](const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  const Vector3 c0 = cross(m[1], m[2]);
  const Vector3 c1 = cross(m[2], m[0]);
  const Vector3 c2 = cross(m[0], m[1]);
  const double determinant = dot(m[0], c0);
  const double size = std::sqrt(dot(m[0], m[0]) * dot(m[1], m[1]) * dot(m[2], m[2]));
  if (!(std::abs(determinant) > 1e-9 * size)) return std::nullopt;
  Vector3 x{};
  for (std::size_t k = 0; k < 3; ++k) {
    x[k] = (right[0] * c0[k] + right[1] * c1[k] + right[2] * c2[k]) / determinant;
  }
  return x;
}

double largest(const Vector3& v) noexcept {
  return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
}

struct Attempt {
  Vector3 p;
  Vector3 error_rad;
};

std::optional<Attempt> attempt(const Vector3& p, const Vector3& wanted) noexcept {
  const auto angles = leg_angles_rad(p);
  if (!angles) return std::nullopt;
  Attempt result{p, {}};
  for (std::size_t i = 0; i < 3; ++i) {
    result.error_rad[i] = (*angles)[i] - wanted[i];
    if (!std::isfinite(result.error_rad[i])) return std::nullopt;
  }
  return result;
}

/// A part of Newton's step that brings the angles closer: the whole, half of it, ...
std::optional<Attempt> better(const Attempt& from, const Vector3& wanted) noexcept {
  const auto jacobian = jacobian_rad_per_m(from.p);
  const auto step = jacobian ? solve(*jacobian, from.error_rad) : std::nullopt;
  if (!step) return std::nullopt;
  double part = 1.0;
  for (int i = 0; i < kMaxHalvings; ++i, part *= 0.5) {
    Vector3 p = from.p;
    for (std::size_t k = 0; k < 3; ++k) p[k] -= part * (*step)[k];
    const auto next = attempt(p, wanted);
    if (next && largest(next->error_rad) < largest(from.error_rad)) return next;
  }
  return std::nullopt;
}

GripPosition newton(const Vector3& wanted_rad, const Vector3& start_m) noexcept {
  auto latest = attempt(start_m, wanted_rad);
  if (!latest) return {start_m, false, std::numeric_limits<double>::infinity(), 0};
  GripPosition result;
  while (largest(latest->error_rad) > kTolerance_rad && result.iterations < kMaxIterations) {
    const auto next = better(*latest, wanted_rad);
    if (!next) break;
    latest = next;
    ++result.iterations;
  }
  result.p_FG_m = latest->p;
  result.residual_rad = largest(latest->error_rad);
  result.converged = result.residual_rad <= kTolerance_rad;
  return result;
}

}  // namespace

Vector3 angles_rad(const std::array<std::int16_t, 3>& counts) noexcept {
  Vector3 angles{};
  for (std::size_t i = 0; i < 3; ++i) angles[i] = kZeroAngle_rad + counts[i] * kAngle_rad_per_count;
  return angles;
}

std::optional<Vector3> leg_angles_rad(const Vector3& p_FG_m) noexcept {
  Vector3 angles{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto found = leg(i, p_FG_m);
    if (!found) return std::nullopt;
    angles[i] = found->theta;
  }
  return angles;
}

// The third equation of the file comment, differentiated. With X = u + c:
//   (X - a cos) dX + (z - a sin) dz + a (X sin - z cos) dtheta = L dL,   dL = -cot(theta3) dv
std::optional<Matrix3> jacobian_rad_per_m(const Vector3& p_FG_m) noexcept {
  Matrix3 jacobian{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto found = leg(i, p_FG_m);
    if (!found) return std::nullopt;
    const double cos_theta = std::cos(found->theta);
    const double sin_theta = std::sin(found->theta);
    const double lever = kA * (found->outwards * sin_theta - found->z * cos_theta);
    if (!(std::abs(lever) > 1e-9)) return std::nullopt;  // m²; about 1e-3 in the workspace
    const double by_outwards = -(found->outwards - kA * cos_theta) / lever;
    const double by_sideways = -found->length * found->cot_shin / lever;
    const double by_z = -(found->z - kA * sin_theta) / lever;
    jacobian[i] = {by_outwards * found->cos_azimuth - by_sideways * found->sin_azimuth,
                   by_outwards * found->sin_azimuth + by_sideways * found->cos_azimuth, by_z};
  }
  return jacobian;
}

GripPosition grip_position(const Vector3& thigh_rad, const Vector3& start_m) noexcept {
  const GripPosition near_start = newton(thigh_rad, start_m);
  // Across the whole workspace a start can lead into a corner; the middle seldom does.
  return near_start.converged ? near_start : newton(thigh_rad, kMiddle_m);
}

std::optional<Vector3> leg_torques_Nm(const Vector3& p_FG_m, const Vector3& f_G_F_N) noexcept {
  const auto jacobian = jacobian_rad_per_m(p_FG_m);
  if (!jacobian) return std::nullopt;
  Matrix3 transposed{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) transposed[row][column] = (*jacobian)[column][row];
  }
  return solve(transposed, f_G_F_N);
}

}  // namespace drivers::haptic::falcon
