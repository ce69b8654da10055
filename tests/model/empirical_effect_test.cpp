// A torque without a physical name: how its tables act on a joint, against hand calculations.
#include "model/effects/empirical.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "model/effects/effect_chain.h"
#include "model/effects/resistance.h"
#include "sim/model_drive.h"
#include "tests/support/no_alloc_guard.h"

namespace model::effects {
namespace empirical_effect_test {

using Along = Empirical::Along;
using Times = Empirical::Times;

constexpr double kPi = std::numbers::pi;

Empirical::Term term(Along along, Times times, double from, double to, std::vector<double> values) {
  return {along, times, EvenTable::over(from, to, std::move(values))};
}

EffectChain chain(const Empirical& empirical) {
  const AnyEffect any = empirical;
  return EffectChain({&any, 1});
}

TEST(EvenTable, IsLinearBetweenItsValuesAndHoldsTheLastOnes) {
  const EvenTable table = EvenTable::over(-1, 3, {2, 4, -2});
  EXPECT_DOUBLE_EQ(table.at(-1), 2);
  EXPECT_DOUBLE_EQ(table.at(0), 3);
  EXPECT_DOUBLE_EQ(table.at(2), 1);
  EXPECT_DOUBLE_EQ(table.at(-1e9), 2);
  EXPECT_DOUBLE_EQ(table.at(1e9), -2);
  EXPECT_DOUBLE_EQ(table.at(std::numeric_limits<double>::infinity()), -2);
  EXPECT_TRUE(std::isfinite(table.at(std::nan(""))));
}

TEST(EvenTable, OfATurnRepeatsAndClosesItsLastGap) {
  const EvenTable table = EvenTable::of_a_turn({0, 1, 0, -1});
  for (const double turns : {-3.0, 0.0, 7.0}) {
    EXPECT_NEAR(table.at(2 * kPi * turns + kPi / 2), 1, 1e-12);
    EXPECT_NEAR(table.at(2 * kPi * turns + 7 * kPi / 4), -0.5, 1e-12)
        << "between the last value and the first";
  }
}

TEST(EvenTable, RefusesWhatIsNoTable) {
  EXPECT_THROW(EvenTable::over(1, 1, {0, 1}), std::invalid_argument);
  EXPECT_THROW(EvenTable::over(0, 1, {0}), std::invalid_argument);
  EXPECT_THROW(EvenTable::over(0, 1, {0, std::nan("")}), std::invalid_argument);
}

Slide slide(double speed_rad_per_s, double direction, double load_Nm = 0, double position_rad = 0,
            double since_reversal_s = kLongSinceReversal_s) {
  return {.speed_rad_per_s = speed_rad_per_s,
          .direction = direction,
          .position_rad = position_rad,
          .since_reversal_s = since_reversal_s,
          .load_Nm = load_Nm};
}

TEST(EmpiricalEffect, ATableOverVelocityIsTheTorqueAgainstThatVelocity) {
  const EffectChain effects =
      chain(Empirical({term(Along::kVelocity, Times::kOne, -4, 4, {-0.03, 0, 0.05})}));
  EXPECT_NEAR(effects.level_Nm(slide(2, +1)), 0.025, 1e-12);
  EXPECT_NEAR(effects.level_Nm(slide(2, -1)), 0.015, 1e-12) << "the torque is -0.015 N·m: it brakes";
  EXPECT_NEAR(effects.level_Nm(slide(9, -1)), 0.03, 1e-12) << "beyond the range the last value holds";
  EXPECT_EQ(effects.load_Nm(1), 0);
}

TEST(EmpiricalEffect, ATableOverPositionPushesOneWayOrRubsBothWays) {
  const EffectChain pushes = chain(Empirical({term(Along::kPosition, Times::kOne, 0, 1, {0, 0.02})}));
  EXPECT_NEAR(pushes.load_Nm(0.5), 0.01, 1e-12);
  EXPECT_EQ(pushes.level_Nm(slide(1, -1, 0, 0.5)), 0);
  const EffectChain rubs = chain(Empirical({term(Along::kPosition, Times::kDirection, 0, 1, {0, 0.02})}));
  EXPECT_EQ(rubs.load_Nm(0.5), 0);
  for (const double direction : {-1.0, 1.0})
    EXPECT_NEAR(rubs.level_Nm(slide(3, direction, 0, 0.5)), 0.01, 1e-12);
  const EffectChain drags = chain(Empirical({term(Along::kPosition, Times::kVelocity, 0, 1, {0, 0.02})}));
  for (const double direction : {-1.0, 1.0})
    EXPECT_NEAR(drags.level_Nm(slide(3, direction, 0, 0.5)), 0.03, 1e-12);
}

TEST(EmpiricalEffect, LoadAndTimeSinceTheReversalScaleFriction) {
  const EffectChain by_load = chain(Empirical({term(Along::kLoad, Times::kDirection, 0, 2, {0, 0.4})}));
  EXPECT_NEAR(by_load.level_Nm(slide(1, -1, 0.5)), 0.1, 1e-12);
  const EffectChain meshing = chain(Empirical({term(Along::kVelocity, Times::kLoad, -2, 2, {0.2, 0, 0.2})}));
  EXPECT_NEAR(meshing.level_Nm(slide(1, -1, 0.5)), 0.05, 1e-12) << "a tenth of the load at 1 rad/s";
  const EffectChain relaxes =
      chain(Empirical({term(Along::kSinceReversal, Times::kDirection, 0, 0.2, {0.03, 0.01})}));
  EXPECT_NEAR(relaxes.level_Nm(slide(1, 1, 0, 0, 0.1)), 0.02, 1e-12);
  EXPECT_NEAR(relaxes.level_Nm(slide(1, 1)), 0.01, 1e-12) << "long after";
}

TEST(EmpiricalEffect, RefusesWhatIsNoTerm) {
  EXPECT_THROW(Empirical({}), std::invalid_argument);
  EXPECT_THROW(Empirical({term(Along::kVelocity, Times::kVelocity, 0, 1, {0, 1})}), std::invalid_argument);
  EXPECT_THROW(Empirical({term(Along::kLoad, Times::kOne, 0, 1, {0, 1})}), std::invalid_argument);
  EXPECT_THROW(Empirical({term(Along::kTurn, Times::kOne, 0, 1, {0, 1})}), std::invalid_argument);
}

TEST(EmpiricalEffect, HasUpTo8TermsOf256Values) {
  const auto terms = [](std::size_t count, std::size_t values) {
    return std::vector<Empirical::Term>(
        count, term(Along::kPosition, Times::kOne, 0, 1, std::vector<double>(values, 0.01)));
  };
  EXPECT_NO_THROW(Empirical(terms(8, 256)));
  EXPECT_THROW(Empirical(terms(9, 2)), std::invalid_argument);
  EXPECT_THROW(Empirical(terms(1, 257)), std::invalid_argument);
}

DriveModel drive_of(const Empirical& empirical) {
  return {.inertia_kg_m2 = 0.01, .effects = {AnyEffect(empirical)}};
}

// Friction of 0.02 N·m on 0.01 kg m² takes 2 rad/s²: 4 rad/s last two seconds and 4 rad.
TEST(EmpiricalEffect, ADriveCoastsAsFarAsItsFrictionLetsIt) {
  sim::ModelDrive drive(drive_of(Empirical({term(Along::kPosition, Times::kDirection, -1, 1, {0.02, 0.02})})),
                        1e-3);
  drive.set_velocity(4);
  for (int i = 0; i < 3000; ++i) drive.step(0);
  EXPECT_NEAR(drive.velocity_rad_per_s(), 0, 1e-3);
  EXPECT_NEAR(drive.position_rad(), 4, 0.01);
}

// Constant torque against constant friction, which halves 0.1 s after the reversal.
TEST(EmpiricalEffect, ADriveCountsTheTimeSinceItsReversal) {
  sim::ModelDrive drive(
      drive_of(Empirical({term(Along::kSinceReversal, Times::kDirection, 0.1, 0.101, {0.04, 0.02})})), 1e-3,
      20);
  drive.set_velocity(-0.1);
  for (int i = 0; i < 1000 && drive.velocity_rad_per_s() <= 0; ++i) drive.step(0.06);
  ASSERT_GT(drive.velocity_rad_per_s(), 0);
  for (int i = 0; i < 90; ++i) drive.step(0.06);
  const double early = drive.velocity_rad_per_s();
  EXPECT_NEAR(early, 0.091 * (0.06 - 0.04) / 0.01, 0.01);
  for (int i = 0; i < 20; ++i) drive.step(0.06);
  const double late = drive.velocity_rad_per_s();
  for (int i = 0; i < 100; ++i) drive.step(0.06);
  EXPECT_NEAR(drive.velocity_rad_per_s() - late, 0.1 * (0.06 - 0.02) / 0.01, 1e-3);
}

TEST(EmpiricalEffect, ACompensatorTakesItsPositionTorqueAndItsLeastFriction) {
  const Empirical empirical(
      {{Along::kTurn, Times::kOne, EvenTable::of_a_turn({0, 0.02, 0, -0.02})},
       {Along::kTurn, Times::kDirection, EvenTable::of_a_turn({0.01, 0.03, 0.01, 0.02})},
       term(Along::kVelocity, Times::kOne, -4, 4, {-0.04, 0, 0.04})});
  const JointResistance resistance = resistance_of(drive_of(empirical));
  EXPECT_NEAR(resistance.position.at_Nm(kPi / 2), 0.02, 1e-12);
  EXPECT_NEAR(resistance.position.at_Nm(-kPi / 2), -0.02, 1e-12);
  EXPECT_NEAR(resistance.sliding.level_Nm(2), 0.01 + 0.02, 1e-6);
  EXPECT_NEAR(resistance.sliding.level_Nm(-2), 0.01 + 0.02, 1e-6);
  const EffectChain effects = chain(empirical);
  for (double position = 0; position < 2 * kPi; position += 0.1)
    for (const double velocity : {-3.0, -0.5, 0.5, 3.0})
      EXPECT_LE(resistance.sliding.level_Nm(velocity),
                effects.level_Nm(slide(std::abs(velocity), velocity < 0 ? -1 : 1, 0, position)) + 1e-6);
}

TEST(EmpiricalEffect, ActingNeitherAllocatesNorLocks) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  sim::ModelDrive drive(
      drive_of(Empirical({term(Along::kVelocity, Times::kOne, -4, 4, {-0.03, 0, 0.05}),
                          term(Along::kPosition, Times::kOne, 0, 1, {0, 0.02}),
                          term(Along::kSinceReversal, Times::kDirection, 0, 1, {0.02, 0.01})})),
      1e-3);
  const support::NoAllocGuard guard;
  for (int i = 0; i < 100; ++i) drive.step(0.1);
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace empirical_effect_test
}  // namespace model::effects
