// Torques that an actuator cannot deliver.
#include "control/deadband_modulator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/no_alloc_guard.h"

namespace deadband_modulator_test {

using control::DeadbandModulator;

constexpr double kMin_Nm = 0.03;

TEST(DeadbandModulator, WhatTheActuatorDeliversGoesThroughAndZeroStaysZero) {
  DeadbandModulator torques(kMin_Nm);
  for (const double torque_Nm : {0.0, 0.03, -0.03, 0.5, -2.4}) EXPECT_EQ(torques.step(torque_Nm), torque_Nm);
  DeadbandModulator none;
  EXPECT_EQ(none.step(1e-6), 1e-6);
}

TEST(DeadbandModulator, PulsesHaveTheMeanThatWasWanted) {
  for (const double wanted_Nm : {0.001, 0.01, -0.014, 0.0299}) {
    DeadbandModulator torques(kMin_Nm);
    constexpr int kSteps = 3000;
    double sum_Nm = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double given_Nm = torques.step(wanted_Nm);
      EXPECT_TRUE(given_Nm == 0 || std::abs(given_Nm) == kMin_Nm) << given_Nm;
      sum_Nm += given_Nm;
    }
    // The undelivered remainder never exceeds half a pulse.
    EXPECT_NEAR(sum_Nm / kSteps, wanted_Nm, 0.5 * kMin_Nm / kSteps + 1e-12) << wanted_Nm;
  }
}

TEST(DeadbandModulator, WhatWasOwedIsForgottenWhenNothingIsWantedAnyMore) {
  DeadbandModulator torques(kMin_Nm);
  EXPECT_EQ(torques.step(0.014), 0.0);
  EXPECT_EQ(torques.step(0.0), 0.0);
  EXPECT_EQ(torques.step(0.014), 0.0);  // 0.028 would have been a pulse
  torques.reset();
  EXPECT_EQ(torques.step(0.014), 0.0);
}

TEST(DeadbandModulator, NotANumberIsPassedOnForOthersToRefuse) {
  DeadbandModulator torques(kMin_Nm);
  EXPECT_TRUE(std::isnan(torques.step(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_EQ(torques.step(0.02), kMin_Nm);
}

TEST(DeadbandModulator, DoesNotAllocateOrLock) {
  DeadbandModulator torques(kMin_Nm);
  const support::NoAllocGuard guard;
  for (int i = 0; i < 100; ++i) (void)torques.step(0.001 * i);
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace deadband_modulator_test
