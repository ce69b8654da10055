// Results of a steady-state measurement: the velocities of the thesis, a mean, and a valid confidence
// interval.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "identification/experiments/block_mean.h"
#include "identification/experiments/low_pass.h"
#include "identification/experiments/steady_state.h"
#include "identification/experiments/velocity_sets.h"

namespace identification::experiments {
namespace experiments_statistics_test {

TEST(VelocitySets, HaveThePublishedNumbersOfMeasurementsAndEnds) {
  const std::vector<std::size_t> printed{10, 100, 50, 25, 33, 16, 30, 35, 13};  // thesis, table 3
  ASSERT_EQ(kTable3.size(), printed.size());
  for (std::size_t i = 0; i < printed.size(); ++i) {
    const std::vector<double> velocities = velocities_rad_per_s(kTable3[i]);
    EXPECT_EQ(velocities.size(), printed[i]) << "set " << i + 1;
    EXPECT_DOUBLE_EQ(velocities.back(), kTable3[i].to_rad_per_s);
    for (std::size_t n = 1; n < velocities.size(); ++n)
      EXPECT_NEAR(std::abs(velocities[n] - velocities[n - 1]), kTable3[i].step_rad_per_s, 1e-12);
    // One step after `from`; the last set begins a measurement earlier, which its printed number asks for.
    const double begin = kTable3[i].from_rad_per_s;
    const double step = std::copysign(kTable3[i].step_rad_per_s, kTable3[i].to_rad_per_s - begin);
    EXPECT_NEAR(velocities.front(), i == 8 ? -4.0 : begin + step, 1e-12) << "set " << i + 1;
  }
  EXPECT_EQ(velocities_rad_per_s("1-9").size(), 312U);
}

TEST(VelocitySets, AreChosenByNumberAndRange) {
  EXPECT_EQ(velocities_rad_per_s("1"), velocities_rad_per_s(kTable3[0]));
  EXPECT_EQ(velocities_rad_per_s("1,7-9").size(), 10U + 30U + 35U + 13U);
  EXPECT_DOUBLE_EQ(velocities_rad_per_s("9,1").front(), -4.0);
  for (const char* wrong : {"", "0", "10", "1,", ",1", "3-1", "1;2", "1-", "one", "1 ", "99999999999"})
    EXPECT_THROW((void)velocities_rad_per_s(wrong), std::invalid_argument) << wrong;
}

TEST(BlockMean, AgreesWithHandComputedMeanAndInterval) {
  BlockMean blocks(2);
  for (const double pair_mean : {1.0, 2.0, 3.0, 4.0, 5.0}) {
    blocks.add(pair_mean - 0.5);
    blocks.add(pair_mean + 0.5);
  }
  EXPECT_DOUBLE_EQ(blocks.mean(), 3.0);
  // t95(4)·s/√5 = 2.776·1.5811/2.2361 (tables).
  EXPECT_NEAR(blocks.ci95(), 1.963, 1.963 * 0.003);
  blocks.add(14.0);  // an unfinished block counts in the mean only
  EXPECT_DOUBLE_EQ(blocks.mean(), 4.0);
  EXPECT_NEAR(blocks.ci95(), 1.963, 1.963 * 0.003);
  EXPECT_EQ(blocks.samples(), 11);
}

TEST(BlockMean, ClaimsNothingFromTooLittle) {
  BlockMean blocks(10);
  EXPECT_TRUE(std::isnan(blocks.mean()));
  for (int i = 0; i < 49; ++i) blocks.add(1.0);
  EXPECT_TRUE(std::isnan(blocks.ci95()));
  EXPECT_DOUBLE_EQ(blocks.mean(), 1.0);
  blocks.add(1.0);
  EXPECT_DOUBLE_EQ(blocks.ci95(), 0.0);
}

TEST(StudentT95, AgreesWithTables) {
  EXPECT_NEAR(student_t95(4), 2.776, 0.009);
  EXPECT_NEAR(student_t95(9), 2.262, 0.001);
  EXPECT_NEAR(student_t95(19), 2.093, 0.0005);
  EXPECT_NEAR(student_t95(1e6), 1.95996, 1e-4);
}

/// Share of `runs` in which the interval holds the true mean of AR(1) noise x' = φ·x + e.
double coverage(double phi, int samples, int samples_per_block, int runs) {
  std::mt19937_64 random(20120714);
  std::normal_distribution<double> normal;
  int covered = 0;
  for (int run = 0; run < runs; ++run) {
    BlockMean blocks(samples_per_block);
    double x = normal(random) / std::sqrt(1 - phi * phi);  // stationary from the start
    for (int i = 0; i < samples; ++i) {
      blocks.add(0.25 + x);
      x = phi * x + normal(random);
    }
    covered += std::abs(blocks.mean() - 0.25) <= blocks.ci95() ? 1 : 0;
  }
  return static_cast<double>(covered) / runs;
}

TEST(BlockMean, IntervalCoversTheTrueMeanOfCorrelatedNoise) {
  // 1000 runs: three standard deviations of the share are 0.02. Correlation time 20 samples, block 400.
  EXPECT_NEAR(coverage(0.95, 8000, 400, 1000), 0.95, 0.025);
  EXPECT_NEAR(coverage(0.0, 2000, 100, 1000), 0.95, 0.025);
  // Why blocks: taken as independent, the same samples promise far too much.
  EXPECT_LT(coverage(0.95, 8000, 1, 200), 0.5);
}

TEST(LowPass, FollowsTheExponentialOfAStepAndKeepsTheMean) {
  LowPass filter(10.0, 1e-3);
  filter.reset(0.0);
  for (int i = 0; i < 100; ++i) filter.step(1.0);
  EXPECT_NEAR(filter.value(), 1 - std::exp(-1.0), 1e-12);
}

/// A joint that follows the command against a friction torque with a ripple.
TEST(SteadyState, MeasuresAfterSettlingOnlyAndSumsUp) {
  SteadyStateConfig config{.settle_s = 2, .measure_s = 4, .extra_s = 1};
  SteadyState experiment(config, {0.5, -1.0}, 1e-3);
  ASSERT_EQ(experiment.measurement_count(), 2);
  EXPECT_DOUBLE_EQ(experiment.duration_s(0), 7.0);
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0.0, 1.5e-3);
  for (int measurement = 0; measurement < 2; ++measurement) {
    const double speed = measurement == 0 ? 0.5 : -1.0;
    experiment.begin(measurement, {});
    int cycles = 0;
    for (; !experiment.finished(); ++cycles) {
      const double t = cycles * 1e-3;
      const bool settled = t >= 1.9;  // before, and after the measurement, far off
      const double torque_Nm = settled && t < 6.1 ? 0.06 + noise(random) : 1.0;
      const SetPoint set_point =
          experiment.step({.time_s = t, .velocity_rad_per_s = settled ? speed : 9.0, .torque_Nm = torque_Nm});
      EXPECT_EQ(set_point.command.mode, hal::CommandMode::kVelocity);
      EXPECT_DOUBLE_EQ(set_point.command.target, speed);
    }
    EXPECT_EQ(cycles, 7001);
    std::vector<double> result(experiment.result_columns().size());
    experiment.write_result(result);
    EXPECT_DOUBLE_EQ(result[0], speed);
    // What the low-pass still holds of the 0.94 N·m when measuring begins is exp(-60·0.1) of it, spread over
    // 4 s.
    EXPECT_NEAR(result[1], 0.06, 1e-4);
    EXPECT_LT(result[2], 2e-3);
    EXPECT_DOUBLE_EQ(result[3], speed);
  }
}

TEST(SteadyState, RefusesWhatCannotBeMeasured) {
  EXPECT_THROW(SteadyState({.measure_s = 0.01}, 1e-3), std::invalid_argument);
  EXPECT_THROW(SteadyState({.measure_s = 0.1, .blocks = 200}, 1e-3), std::invalid_argument);
  EXPECT_THROW(SteadyState({.sets = "1,10"}, 1e-3), std::invalid_argument);
  EXPECT_THROW(SteadyState({.blocks = 0}, 1e-3), std::invalid_argument);
}

}  // namespace experiments_statistics_test
}  // namespace identification::experiments
