#include "drivers/haptic/falcon_kinematics.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>

#include "tests/support/no_alloc_guard.h"

namespace drivers::haptic::falcon {
namespace falcon_kinematics_test {

constexpr double kDegree = kPi / 180.0;

double dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double distance(const Vector3& a, const Vector3& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// A ball of 40 mm about the middle of the travel: the haptic workspace.
void for_each_place(const std::function<void(const Vector3&)>& visit) {
  constexpr Vector3 kCentre{0.0, 0.0, 0.13};
  constexpr double kRadius_m = 0.04;
  for (double x = -kRadius_m; x <= kRadius_m; x += 0.01) {
    for (double y = -kRadius_m; y <= kRadius_m; y += 0.01) {
      for (double z = -kRadius_m; z <= kRadius_m; z += 0.01) {
        if (std::hypot(x, y, z) <= kRadius_m + 1e-9) visit({kCentre[0] + x, kCentre[1] + y, kCentre[2] + z});
      }
    }
  }
}

struct KnownAngles {
  Vector3 p_m;
  Vector3 degrees;
};

TEST(FalconKinematics, KnownAnglesOfKnownPlaces) {
  for (const KnownAngles& known : {KnownAngles{{0, 0, 0.110}, {16.1880, 16.1880, 16.1880}},
                                   KnownAngles{{0.02, 0.01, 0.12}, {23.8701, 14.8169, 38.5990}},
                                   KnownAngles{{-0.03, 0.02, 0.10}, {-7.7440, 37.6494, 10.5818}},
                                   KnownAngles{{0, 0, 0.150}, {47.2433, 47.2433, 47.2433}}}) {
    const auto angles = leg_angles_rad(known.p_m);
    ASSERT_TRUE(angles);
    // Half of the last digit printed.
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR((*angles)[i] / kDegree, known.degrees[i], 0.51e-4) << i;
  }
}

struct KnownPlace {
  std::array<std::int16_t, 3> counts;
  Vector3 p_m;
};

TEST(FalconKinematics, KnownPlacesOfKnownCounts) {
  for (const KnownPlace& known :
       {KnownPlace{{0, 0, 0}, {0, 0, 0.13460}}, KnownPlace{{-500, -500, -500}, {0, 0, 0.11075}},
        KnownPlace{{500, 500, 500}, {0, 0, 0.15686}}, KnownPlace{{-1000, -1000, -1000}, {0, 0, 0.08961}},
        KnownPlace{{1000, 1000, 1000}, {0, 0, 0.17360}},
        KnownPlace{{300, 0, -300}, {-0.00412, -0.02165, 0.13232}}}) {
    const GripPosition grip = grip_position(angles_rad(known.counts), kMiddle_m);
    ASSERT_TRUE(grip.converged) << known.counts[0];
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(grip.p_FG_m[k], known.p_m[k], 0.51e-5) << k;
  }
}

TEST(FalconKinematics, CountIsTheKnownPartOfADegree) {
  EXPECT_NEAR(kAngle_rad_per_count / kDegree, 0.0364347, 0.5e-7);
  const Vector3 angles = angles_rad({0, 1000, -1000});
  EXPECT_DOUBLE_EQ(angles[0] / kDegree, 35.0);
  EXPECT_NEAR(angles[1] / kDegree, 35.0 + 36.4347, 1e-4);
  EXPECT_NEAR(angles[2] / kDegree, 35.0 - 36.4347, 1e-4);
}

// Rotating the handle's position by 120° about z shifts the angles to the next leg.
TEST(FalconKinematics, LegsAreOneAnothersImageAThirdOfATurnOn) {
  const Vector3 p{0.02, -0.015, 0.125};
  const double c = std::cos(120 * kDegree);
  const double s = std::sin(120 * kDegree);
  const auto here = leg_angles_rad(p);
  const auto turned = leg_angles_rad({p[0] * c - p[1] * s, p[0] * s + p[1] * c, p[2]});
  ASSERT_TRUE(here && turned);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR((*turned)[i], (*here)[(i + 1) % 3], 1e-12) << i;
}

TEST(FalconKinematics, ForwardUndoesInverseAllOverTheWorkspace) {
  for_each_place([](const Vector3& p) {
    const auto angles = leg_angles_rad(p);
    ASSERT_TRUE(angles);
    const GripPosition grip = grip_position(*angles, kMiddle_m);
    ASSERT_TRUE(grip.converged);
    EXPECT_LE(grip.residual_rad, 1e-9);
    EXPECT_LT(distance(grip.p_FG_m, p), 1e-9);  // 1e-9 rad on a thigh of 0.06 m, with room for the gearing
    EXPECT_LE(grip.iterations, 8);
  });
}

TEST(FalconKinematics, NeighbourTakesThreeStepsAtMost) {
  for_each_place([](const Vector3& p) {
    const auto angles = leg_angles_rad(p);
    ASSERT_TRUE(angles);
    // 1 m/s for 1 ms in each direction.
    const GripPosition grip = grip_position(*angles, {p[0] + 1e-3, p[1] - 1e-3, p[2] + 1e-3});
    EXPECT_TRUE(grip.converged);
    EXPECT_LE(grip.iterations, 3);
  });
}

TEST(FalconKinematics, ForwardStartsAfreshFromAPlaceOutOfReach) {
  const Vector3 p{0.01, 0.02, 0.13};
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const Vector3& start : {Vector3{1, 1, 1}, Vector3{0, 0, 0}, Vector3{kNan, 0, 0.1}}) {
    const GripPosition grip = grip_position(*leg_angles_rad(p), start);
    EXPECT_TRUE(grip.converged);
    EXPECT_LT(distance(grip.p_FG_m, p), 1e-9);
  }
}

struct Jump {
  Vector3 from_m, to_m;
};

// Pairs at the boundary of the legs' reach, between which Newton's steps get stuck.
TEST(FalconKinematics, ForwardStartsAfreshWhenTheStartLeadsNowhere) {
  for (const Jump& jump : {Jump{{-0.037, -0.034, 0.163}, {0.049, 0.044, 0.116}},
                           Jump{{-0.047, 0.049, 0.149}, {0.025, 0.017, 0.085}},
                           Jump{{-0.021, 0.035, 0.118}, {0.046, -0.029, 0.098}}}) {
    const auto angles = leg_angles_rad(jump.to_m);
    ASSERT_TRUE(angles);
    const GripPosition grip = grip_position(*angles, jump.from_m);
    EXPECT_TRUE(grip.converged);
    EXPECT_LT(distance(grip.p_FG_m, jump.to_m), 1e-9);
  }
}

TEST(FalconKinematics, ImpossibleAnglesDoNotConverge) {
  EXPECT_FALSE(grip_position({170 * kDegree, -80 * kDegree, 170 * kDegree}, kMiddle_m).converged);
  EXPECT_FALSE(grip_position(angles_rad({32767, 32767, 32767}), kMiddle_m).converged);
  EXPECT_FALSE(grip_position(angles_rad({-32768, 0, 32767}), kMiddle_m).converged);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = 0; i < 3; ++i) {
    Vector3 angles{0.5, 0.5, 0.5};
    angles[i] = kNan;
    EXPECT_FALSE(grip_position(angles, kMiddle_m).converged) << i;
  }
}

TEST(FalconKinematics, PlacesOutOfReachHaveNoAngles) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const Vector3& p : {Vector3{0, 0, 0.3}, Vector3{0.2, 0, 0.1}, Vector3{0, -0.2, 0.1}, Vector3{0, 0, 0},
                           Vector3{kNan, 0, 0.1}, Vector3{0, 0, kNan}, Vector3{0, kInfinity, 0.1}}) {
    EXPECT_FALSE(leg_angles_rad(p)) << p[0] << ' ' << p[1] << ' ' << p[2];
    EXPECT_FALSE(jacobian_rad_per_m(p));
    EXPECT_FALSE(leg_torques_Nm(p, {0, 0, 1}));
  }
}

TEST(FalconKinematics, JacobianIsTheSlopeOfTheInverse) {
  constexpr double kStep_m = 1e-5;
  for_each_place([](const Vector3& p) {
    const auto jacobian = jacobian_rad_per_m(p);
    ASSERT_TRUE(jacobian);
    for (std::size_t k = 0; k < 3; ++k) {
      Vector3 above = p;
      Vector3 below = p;
      above[k] += kStep_m;
      below[k] -= kStep_m;
      const auto more = leg_angles_rad(above);
      const auto less = leg_angles_rad(below);
      ASSERT_TRUE(more && less);
      for (std::size_t i = 0; i < 3; ++i) {
        // The difference errs by a sixth of the third derivative times the step squared.
        EXPECT_NEAR((*jacobian)[i][k], ((*more)[i] - (*less)[i]) / (2 * kStep_m), 1e-4) << i << k;
      }
    }
  });
}

TEST(FalconKinematics, KnownTorqueOfOneNewtonOutwards) {
  const GripPosition grip = grip_position(angles_rad({0, 0, 0}), kMiddle_m);
  const auto torques = leg_torques_Nm(grip.p_FG_m, {0, 0, 1});
  ASSERT_TRUE(torques);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR((*torques)[i], 0.02494, 0.51e-5) << i;
}

// The hand receives the work of the motors: tau . dtheta = F . dp.
TEST(FalconKinematics, VirtualWorkIsTheSameOnBothSides) {
  constexpr Vector3 kForce_N{3.0, -2.0, 5.0};
  constexpr Vector3 kStep_m{2e-6, 3e-6, -1e-6};
  for_each_place([&](const Vector3& p) {
    const auto torques = leg_torques_Nm(p, kForce_N);
    ASSERT_TRUE(torques);
    const Vector3 half{kStep_m[0] / 2, kStep_m[1] / 2, kStep_m[2] / 2};
    const auto after = leg_angles_rad({p[0] + half[0], p[1] + half[1], p[2] + half[2]});
    const auto before = leg_angles_rad({p[0] - half[0], p[1] - half[1], p[2] - half[2]});
    ASSERT_TRUE(after && before);
    const Vector3 turn{(*after)[0] - (*before)[0], (*after)[1] - (*before)[1], (*after)[2] - (*before)[2]};
    EXPECT_NEAR(dot(*torques, turn), dot(kForce_N, kStep_m), 1e-7 * 5e-6 * 6.2);  // relative 1e-7, see above
  });
}

TEST(FalconKinematics, DoesNotAllocateOrLock) {
  const support::NoAllocGuard guard;
  const GripPosition grip = grip_position(angles_rad({300, 0, -300}), kMiddle_m);
  const auto torques = leg_torques_Nm(grip.p_FG_m, {1, 2, 3});
  const long violations = guard.violations();
  EXPECT_TRUE(grip.converged && torques);
  EXPECT_EQ(violations, 0);
}

}  // namespace falcon_kinematics_test
}  // namespace drivers::haptic::falcon
