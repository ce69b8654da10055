/// @file
/// Where the Novint Falcon's handle is, and which torques push it: three legs on motors, the handle never
/// turns. After R. E. Stamper, "A Three Degree of Freedom Parallel Manipulator with Only Translational
/// Degrees of Freedom", 1997; dimensions from libnifalcon, FalconGeometry.h.
///
/// Frame F, right-handed: z runs along the axis of symmetry from the base out towards the user, 0 in the
/// plane of the thighs' axes; x and y such that the legs stand at 105°, -15° and -135° from x towards y.
/// That x then points right and y up is not confirmed on a device. G: the handle. Leg i: thigh angle
/// theta_i, positive out towards the user. Metres, radians, newtons.
///
/// For each leg, with (u, v, w) the handle seen from the leg and L the shin's length in its plane of motion:
///   b cos(theta3) = v + f,   L = d + e + b sin(theta3),
///   (u + c - a cos(theta))^2 + (w - a sin(theta))^2 = L^2.
/// Cycle: nothing allocates, and each loop has a bound. An empty result: not a position that the legs reach.
#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "drivers/haptic/vector3.h"

namespace drivers::haptic::falcon {

using Matrix3 = std::array<Vector3, 3>;  ///< rows

/// Encoder of 320 slots, four counts each, on a shaft of 14.25 mm that winds a sector of 110 mm.
inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kAngle_rad_per_count = 2.0 * kPi / (320 * 4) * (14.25 / 110.0);
/// Thigh angle at count 0, once homed; approximate by its source's own comment.
inline constexpr double kZeroAngle_rad = 35.0 * kPi / 180.0;
/// In the middle of the workspace: a start for grip_position() when there is no better one.
inline constexpr Vector3 kMiddle_m{0.0, 0.0, 0.12};

Vector3 angles_rad(const std::array<std::int16_t, 3>& counts) noexcept;

/// Thigh angles that put the handle there, knees outwards.
std::optional<Vector3> leg_angles_rad(const Vector3& p_FG_m) noexcept;

/// J = d theta / d p, row i for leg i, rad/m. Empty also where a leg is stretched or folded.
std::optional<Matrix3> jacobian_rad_per_m(const Vector3& p_FG_m) noexcept;

struct GripPosition {
  Vector3 p_FG_m{};
  bool converged = false;   ///< every thigh angle within 1e-9 rad; otherwise do not use it
  double residual_rad = 0;  ///< largest deviation of a thigh angle
  std::uint8_t iterations = 0;
};
/// The handle's position for these thigh angles, by Newton's method from `start_m` (the latest position:
/// neighbours take two or three steps). Tries again from kMiddle_m when that does not converge.
GripPosition grip_position(const Vector3& thigh_rad, const Vector3& start_m) noexcept;

/// Torques about the thighs' axes, N·m along positive theta, that make this force on the hand: the solution
/// of transpose(J) tau = F. Empty where no torques do.
std::optional<Vector3> leg_torques_Nm(const Vector3& p_FG_m, const Vector3& f_G_F_N) noexcept;

}  // namespace drivers::haptic::falcon
