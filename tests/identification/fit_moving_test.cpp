// Inertia and friction from motion: hidden truth from an integrator written here.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "identification/fit/moving_fit.h"
#include "identification/recording.h"

namespace identify_moving_test {

using identification::fit::Estimate;
using identification::fit::estimate_of;
using identification::fit::fit_moving;
using identification::fit::MovingFit;

constexpr double kTick_rad = 2 * std::numbers::pi / 104000;

struct Truth {
  double inertia = 0.0112;
  double coulomb = 0.045;
  double viscous = 0.0125;
  double offset = 0.003;
};

/// Speed rides on a sum of sines that stays away from reversals for most of the time; the torque that does it
/// is computed exactly, and both are measured as a drive does.
identification::Recording recorded(const Truth& truth, unsigned seed, double noise_Nm = 0.0015,
                                   double swing = 1, double mean_speed = 0, double seconds = 20) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, noise_Nm);
  identification::Recording recording;
  recording.rig = "wheel-1";
  recording.experiment = "moving";
  recording.columns = {{"time_s", {}}, {"torque_measured_Nm", {}}, {"position_rad", {}}};
  // Where the ticks lie differs from run to run, as on a rig: their errors are not the same ones again.
  const double start_rad = std::uniform_real_distribution<double>(0, 1)(random);
  const double w1 = 2 * std::numbers::pi * (0.35 + 0.01 * start_rad);
  const double w2 = 2 * std::numbers::pi * 1.3;
  for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) {
    const double t = i * 1e-3;
    const double x =
        start_rad + mean_speed * t + swing * (-4 / w1 * std::cos(w1 * t) + 1.5 / w2 * std::sin(w2 * t));
    const double v = mean_speed + swing * (4 * std::sin(w1 * t) + 1.5 * std::cos(w2 * t));
    const double a = swing * (4 * w1 * std::cos(w1 * t) - 1.5 * w2 * std::sin(w2 * t));
    const double torque =
        truth.inertia * a + (v > 0 ? 1 : -1) * truth.coulomb + truth.viscous * v + truth.offset;
    recording.columns[0].values.push_back(t);
    recording.columns[1].values.push_back(torque + noise(random));
    recording.columns[2].values.push_back(kTick_rad * std::floor(x / kTick_rad));
  }
  return recording;
}

TEST(IdentifyMoving, FindsInertiaAndFrictionTogether) {
  const Truth truth;
  const MovingFit fit = fit_moving(recorded(truth, 1));
  EXPECT_NEAR(estimate_of(fit.parameters, "", "inertia_kg_m2").value, truth.inertia, 0.02 * truth.inertia);
  EXPECT_NEAR(estimate_of(fit.parameters, "coulomb", "torque_Nm").value, truth.coulomb, 0.02 * truth.coulomb);
  EXPECT_NEAR(estimate_of(fit.parameters, "viscous", "coefficient_Nm_s_per_rad").value, truth.viscous,
              0.02 * truth.viscous);
  EXPECT_NEAR(estimate_of(fit.parameters, "torque_offset", "torque_Nm").value, truth.offset, 3e-4);
  EXPECT_TRUE(fit.verdicts.empty());
  EXPECT_LT(fit.relative_error_percent, 3);
}

TEST(IdentifyMoving, FrictionBelowZeroIsSaidAndNoNumber) {
  const MovingFit driven = fit_moving(recorded({.viscous = -0.004}, 1));
  EXPECT_EQ(estimate_of(driven.parameters, "viscous", "coefficient_Nm_s_per_rad").not_identifiable,
            "came out below zero, where no friction is: something else is in this motion");
  EXPECT_TRUE(estimate_of(driven.parameters, "coulomb", "torque_Nm").ok());
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const MovingFit none = fit_moving(recorded({.viscous = 0}, seed));
    const Estimate& viscous = estimate_of(none.parameters, "viscous", "coefficient_Nm_s_per_rad");
    EXPECT_TRUE(!viscous.ok() || viscous.value >= 0) << viscous.value;
  }
}

TEST(IdentifyMoving, IntervalsHoldTheTruth) {
  const Truth truth;
  constexpr int kRecordings = 60;
  int covered[4] = {};
  const double values[4] = {truth.inertia, truth.coulomb, truth.viscous, truth.offset};
  for (unsigned seed = 1; seed <= kRecordings; ++seed) {
    const MovingFit fit = fit_moving(recorded(truth, seed));
    for (std::size_t k = 0; k < 4; ++k)
      covered[k] += fit.parameters[k].lower <= values[k] && values[k] <= fit.parameters[k].upper ? 1 : 0;
  }
  for (const int count : covered) EXPECT_GE(count, 52);
}

/// The torque `late` rows later, or earlier if negative.
identification::Recording shifted(identification::Recording recording, int late) {
  std::vector<double>& torque = recording.columns[1].values;
  if (late > 0)
    std::shift_right(torque.begin(), torque.end(), late);
  else
    std::shift_left(torque.begin(), torque.end(), -late);
  return recording;
}

/// From a row early to a few rows late, as recorders write it.
TEST(IdentifyMoving, ATorqueThatIsLateBiasesNothing) {
  const Truth truth;
  for (const int late : {-1, 1, 3}) {
    const MovingFit fit = fit_moving(shifted(recorded(truth, 5), late));
    EXPECT_NEAR(fit.torque_lag_s, 1e-3 * late, 5e-4);
    EXPECT_NEAR(estimate_of(fit.parameters, "coulomb", "torque_Nm").value, truth.coulomb,
                0.02 * truth.coulomb);
    EXPECT_NEAR(estimate_of(fit.parameters, "viscous", "coefficient_Nm_s_per_rad").value, truth.viscous,
                0.02 * truth.viscous);
  }
}

/// The torque a fraction of a row late, in a noise that hides it.
identification::Recording late_by(identification::Recording recording, double lag_s) {
  const std::vector<double> torque = recording.columns[1].values;
  for (std::size_t i = 1; i < torque.size(); ++i)
    recording.columns[1].values[i] += (torque[i - 1] - torque[i]) * lag_s / 1e-3;
  return recording;
}

TEST(IdentifyMoving, IntervalsHoldTheTruthAlsoWithALagThatDoesNotShow) {
  const Truth truth;
  constexpr int kRecordings = 60;
  const double values[4] = {truth.inertia, truth.coulomb, truth.viscous, truth.offset};
  int covered[4] = {};
  int hidden = 0;
  for (unsigned seed = 1; seed <= kRecordings; ++seed) {
    const MovingFit fit = fit_moving(late_by(recorded(truth, seed, 0.05, 1, 0, 8), 0.9e-3));
    if (fit.torque_lag_s != 0) continue;
    ++hidden;
    for (std::size_t k = 0; k < 4; ++k)
      covered[k] += fit.parameters[k].lower <= values[k] && values[k] <= fit.parameters[k].upper ? 1 : 0;
  }
  ASSERT_GE(hidden, 20);
  for (const int count : covered) EXPECT_GE(count, 0.87 * hidden);
}

TEST(IdentifyMoving, ALagBeyondItsRangeIsReportedAndInTheIntervals) {
  const Truth truth;
  for (const int late : {-6, 16}) {
    const MovingFit fit = fit_moving(shifted(recorded(truth, 5), late));
    EXPECT_EQ(fit.torque_lag_s, late > 0 ? 0.01 : -0.002);
    ASSERT_FALSE(fit.verdicts.empty());
    EXPECT_EQ(fit.verdicts[0].find(late > 0 ? "torque lag at the end of its range: 10 ms of 1"
                                            : "torque lag at the end of its range: -2 ms of -"),
              0U)
        << fit.verdicts[0];
    EXPECT_NE(fit.verdicts[0].find(late > 0 ? "no recorder is that late" : "no recorder is that early"),
              std::string::npos)
        << fit.verdicts[0];
    const Estimate& viscous = estimate_of(fit.parameters, "viscous", "coefficient_Nm_s_per_rad");
    EXPECT_LE(viscous.lower, truth.viscous);
    EXPECT_GE(viscous.upper, truth.viscous);
  }
}

TEST(IdentifyMoving, AnotherTermThatRulesTheMotionIsReported) {
  identification::Recording recording = recorded({}, 1);
  for (std::size_t i = 0; i < recording.rows(); ++i)
    recording.columns[1].values[i] += 0.8 * std::sin(recording.columns[2].values[i]);  // a weight
  const MovingFit fit = fit_moving(recording);
  ASSERT_FALSE(fit.verdicts.empty());
  EXPECT_NE(fit.verdicts.back().find("% of the torque: a weight, a contact"), std::string::npos)
      << fit.verdicts.back();
}

TEST(IdentifyMoving, ConstantVelocityShowsNoInertia) {
  const MovingFit fit = fit_moving(recorded({}, 1, 0.0015, 0, 3));
  EXPECT_FALSE(estimate_of(fit.parameters, "", "inertia_kg_m2").ok());
  EXPECT_FALSE(estimate_of(fit.parameters, "viscous", "coefficient_Nm_s_per_rad").ok());
  EXPECT_FALSE(estimate_of(fit.parameters, "coulomb", "torque_Nm").ok());
  EXPECT_FALSE(estimate_of(fit.parameters, "torque_offset", "torque_Nm").ok());
  EXPECT_FALSE(fit.verdicts.empty());
}

TEST(IdentifyMoving, RefusesWhatDoesNotMoveOrIsNotEven) {
  EXPECT_THROW(fit_moving(recorded({}, 1, 0.0015, 0, 0)), std::invalid_argument);
  EXPECT_THROW(fit_moving(recorded({}, 1, 0.0015, 1, 0, 0.05)), std::invalid_argument);
  identification::Recording uneven = recorded({}, 1);
  for (std::size_t i = 0; i < uneven.rows(); ++i)
    uneven.columns[0].values[i] += 0.0007 * static_cast<double>(i % 2);
  EXPECT_THROW(fit_moving(uneven), std::invalid_argument);
  identification::Recording without = recorded({}, 1);
  without.columns.erase(without.columns.begin() + 2);
  EXPECT_THROW(fit_moving(without), std::invalid_argument);
}

}  // namespace identify_moving_test
