// Limiting keeps directions and reports that it limited.
#include "control/limits.h"

#include <gtest/gtest.h>

namespace limits_test {

using control::limited_torque;
using control::limited_wrench;
using control::PlanarVector;
using control::WheelVector;

TEST(LimitedWrench, PassesWhatFitsUntouched) {
  for (const PlanarVector& wrench :
       {PlanarVector(0, 0, 0), PlanarVector(3, -4, 1), PlanarVector(6, 0, -2), PlanarVector(0, -6, 2)}) {
    const auto result = limited_wrench(wrench, {.force_N = 6, .moment_Nm = 2});
    EXPECT_EQ(result.value, wrench);
    EXPECT_FALSE(result.limited);
  }
}

TEST(LimitedWrench, ShortensTheForceAlongItsDirectionAndLeavesTheMoment) {
  const auto result = limited_wrench({30, -40, 1.5}, {.force_N = 5, .moment_Nm = 2});
  EXPECT_TRUE(result.limited);
  EXPECT_TRUE(result.value.isApprox(PlanarVector(3, -4, 1.5), 1e-14)) << result.value.transpose();
}

TEST(LimitedWrench, BoundsTheMomentOnItsOwnAndLeavesTheForce) {
  for (const double sign : {-1.0, 1.0}) {
    const auto result = limited_wrench({3, 4, sign * 10}, {.force_N = 6, .moment_Nm = 2});
    EXPECT_TRUE(result.limited);
    EXPECT_EQ(result.value, PlanarVector(3, 4, sign * 2));
  }
}

TEST(LimitedWrench, ZeroLimitsAllowNothing) {
  const auto result = limited_wrench({1, 2, 3}, {.force_N = 0, .moment_Nm = 0});
  EXPECT_TRUE(result.limited);
  EXPECT_EQ(result.value, PlanarVector::Zero());
}

TEST(LimitedTorque, PassesWhatFitsUntouched) {
  for (const WheelVector& torque_Nm : {WheelVector(0, 0, 0, 0), WheelVector(1, -2, 0.5, 2)}) {
    const auto result = limited_torque(torque_Nm, 2.0);
    EXPECT_EQ(result.value, torque_Nm);
    EXPECT_FALSE(result.limited);
  }
}

TEST(LimitedTorque, ScalesAllWheelsTogetherUntilTheLargestFits) {
  for (const double sign : {-1.0, 1.0}) {
    const auto result = limited_torque(sign * WheelVector(1, -8, 2, 4), 2.0);
    EXPECT_TRUE(result.limited);
    EXPECT_TRUE(result.value.isApprox(sign * WheelVector(0.25, -2, 0.5, 1), 1e-14))
        << result.value.transpose();
  }
}

TEST(LimitedTorque, AZeroLimitAllowsNothing) {
  const auto result = limited_torque({1, -2, 3, -4}, 0.0);
  EXPECT_TRUE(result.limited);
  EXPECT_EQ(result.value, WheelVector::Zero());
}

}  // namespace limits_test
