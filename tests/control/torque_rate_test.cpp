// The rate limit of a torque.
#include "control/torque_rate.h"

#include <gtest/gtest.h>

#include <limits>

namespace control {
namespace {

TEST(TorqueRate, ReachesFullTorqueInTheTwelveMillisecondsOfLibfranka) {
  constexpr double kFull_Nm = 2.4;
  TorqueRate rate(kTorqueRate_per_s * kFull_Nm, 1e-3);
  int cycles = 0;
  double sent_Nm = 0;
  while (sent_Nm < kFull_Nm) {
    const double before_Nm = sent_Nm;
    sent_Nm = rate.step(kFull_Nm);
    EXPECT_LE(sent_Nm - before_Nm, 0.2 + 1e-12) << "1000 N·m/s · 2.4/12";
    ASSERT_LT(++cycles, 100);
  }
  EXPECT_NEAR(cycles, 12, 1);
  EXPECT_EQ(rate.step(kFull_Nm), kFull_Nm);
  EXPECT_FALSE(rate.limited());
}

TEST(TorqueRate, SaysWhenItCutAndOnlyThen) {
  TorqueRate rate(200, 1e-3);
  EXPECT_EQ(rate.step(0.15), 0.15);
  EXPECT_FALSE(rate.limited());
  EXPECT_DOUBLE_EQ(rate.step(-0.15), -0.05);
  EXPECT_TRUE(rate.limited());
  EXPECT_EQ(rate.step(-0.15), -0.15);
  EXPECT_FALSE(rate.limited());
}

TEST(TorqueRate, DoesNotSlowDownWhatPassesAndGoesOnFromThere) {
  TorqueRate rate(200, 1e-3);
  EXPECT_EQ(rate.pass(-2.0), -2.0);
  EXPECT_FALSE(rate.limited());
  EXPECT_DOUBLE_EQ(rate.step(2.0), -1.8);
}

TEST(TorqueRate, LeavesWhatIsNotFiniteForTheRobotToRefuse) {
  TorqueRate rate(200, 1e-3);
  EXPECT_TRUE(std::isnan(rate.step(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_TRUE(std::isinf(rate.step(std::numeric_limits<double>::infinity())));
}

}  // namespace
}  // namespace control
