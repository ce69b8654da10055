// The load on a joint that an experiment predicts.
#include "identification/experiments/rehearsal.h"

#include <gtest/gtest.h>

#include "identification/experiments/dahl.h"
#include "identification/experiments/reversals.h"
#include "identification/experiments/staircase.h"
#include "identification/experiments/steady_state.h"
#include "identification/experiments/stick_slip.h"
#include "identification/experiments/torque_ramp.h"
#include "identification/experiments/torque_wave.h"

namespace identification::experiments {
namespace experiments_rehearsal_test {

constexpr double kPeriod_s = 1e-3;

TEST(Rehearsal, ConstantVelocityTakesSpeedTimesTimeAndTheWayToStop) {
  SteadyState experiment({.settle_s = 1, .measure_s = 2, .extra_s = 1}, {0.5, -0.25}, kPeriod_s);
  const Demand demand = rehearse(experiment, 0, kPeriod_s);
  // From rest it is behind by v²/2a, which it also needs to stop.
  EXPECT_NEAR(demand.highest_rad, 0.5 * 4 + 0.03 * 0.5, 2e-3);
  EXPECT_EQ(demand.lowest_rad, 0);
  EXPECT_EQ(demand.speed_rad_per_s, 0.5);
  EXPECT_EQ(demand.torque_Nm, 0);
  EXPECT_FALSE(demand.by_torque);
  const Demand rest = rehearse(experiment, 1, kPeriod_s);  // remainder after an interruption
  EXPECT_EQ(rest.speed_rad_per_s, 0.25);
  EXPECT_NEAR(rest.lowest_rad, -(0.25 * 4 + 0.03 * 0.25), 2e-3);
  EXPECT_EQ(rest.highest_rad, 0);
}

TEST(Rehearsal, ReversalsGoOneWayAndComeBack) {
  Reversals experiment({.highest_rad_per_s = 0.4, .lowest_rad_per_s = 0.4, .period_s = 4, .periods = 3});
  const Demand demand = rehearse(experiment, 0, kPeriod_s);
  // A triangle of 0.4 rad/s over half a period of 4 s.
  EXPECT_NEAR(demand.highest_rad, 0.4, 0.02);
  EXPECT_GE(demand.highest_rad, 0.4);
  EXPECT_NEAR(demand.lowest_rad, 0, 0.01);
  EXPECT_NEAR(demand.speed_rad_per_s, 0.4, 1e-9);
}

TEST(Rehearsal, AStepOfVelocityIsTakenGently) {
  Staircase experiment({.quantity = "velocity", .step = 1.0, .highest = 1.0, .hold_s = 2});
  const Demand demand = rehearse(experiment, 0, kPeriod_s);
  // 1 rad/s² up for 1 s, on for 1 s, and down.
  EXPECT_NEAR(demand.highest_rad, 2 + 0.03, 5e-3);
  EXPECT_NEAR(demand.lowest_rad, 0, 0.04);
}

TEST(Rehearsal, TorqueIsTheMostThatAnyExperimentCommands) {
  TorqueRamp ramp({.rest_s = 0.1, .rate_Nm_per_s = 1, .highest_torque_Nm = 0.7, .repeats = 1}, 1e-5,
                  kPeriod_s);
  EXPECT_NEAR(rehearse(ramp, 0, kPeriod_s).torque_Nm, 0.7, 2e-3);
  Dahl dahl({.amplitude_Nm = 0.3, .frequency_Hz = 1, .cycles = 2}, 1e-5);
  EXPECT_NEAR(rehearse(dahl, 0, kPeriod_s).torque_Nm, 0.3, 1e-5);
  TorqueWave wave(MultisineConfig{.peak_Nm = 0.9, .period_s = 2, .periods = 1}, kPeriod_s);
  EXPECT_NEAR(rehearse(wave, 0, kPeriod_s).torque_Nm, 0.9, 1e-3);
  // The spring of 2 N·m/rad is pulled by 0.1 rad/s for 3 s, or until its limit.
  StickSlip weak({.speed_rad_per_s = 0.1, .stiffness_Nm_per_rad = 2, .duration_s = 3});
  EXPECT_NEAR(rehearse(weak, 0, kPeriod_s).torque_Nm, 0.5, 1e-9) << "its limit";
  StickSlip pulled(
      {.speed_rad_per_s = 0.1, .stiffness_Nm_per_rad = 2, .torque_limit_Nm = 5, .duration_s = 3});
  const Demand demand = rehearse(pulled, 0, kPeriod_s);
  EXPECT_NEAR(demand.torque_Nm, 0.6, 2e-3);
  EXPECT_TRUE(demand.by_torque);
  EXPECT_EQ(demand.speed_rad_per_s, 0);
}

}  // namespace experiments_rehearsal_test
}  // namespace identification::experiments
