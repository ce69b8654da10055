// Compensation from a velocity: its torque, and whether the compensated joint can drive itself.
#include "model/friction/law_compensator.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <stdexcept>

#include "control/friction_compensator.h"
#include "control/friction_observer.h"
#include "tests/model/friction_joint.h"
#include "tests/support/no_alloc_guard.h"

namespace law_compensator_test {

using namespace model::friction;  // NOLINT(google-build-using-namespace)

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

const AnyLaw kKfm = make_law("kfm");
constexpr LawCompensator::Config kConfig{
    .margin = 0.9, .blend_speed_rad_per_s = 0.1, .quiet_speed_rad_per_s = 0.02, .grid = kLawGrid};

TEST(LawTable, BringsAnyLawToTheObserverAndItsCompensator) {
  for (const LawDescription& description : law_descriptions()) {
    const AnyLaw law = make_law(description.name);
    const SlidingTable table = law_table(law);
    for (const double velocity : {-5.0, -0.5, 0.5, 5.0})  // straight lines of 0.02 rad/s
      EXPECT_NEAR(table.level_Nm(velocity), std::abs(law.steady_Nm(velocity)), 1e-4) << description.name;
  }
  EXPECT_NEAR(law_table(kKfm).breakaway_Nm(1), kKfm.parameter("static_Nm"), 1e-12);
  control::FrictionObserver observer(law_table(kKfm), {});
  const control::FrictionCompensator compensator({.margin = 0.9});
  EXPECT_NEAR(compensator.torque_Nm(1.0, observer.step(0.0), observer), 0.9 * kKfm.parameter("static_Nm"),
              1e-12);
}

TEST(LawCompensator, GivesTheMarginOfTheFrictionOfAMotionAndNothingAtRest) {
  const LawCompensator compensator(kKfm, kConfig);
  for (const double velocity : {-3.0, -0.1, 0.1, 0.7})
    EXPECT_NEAR(compensator.from_measured_Nm(velocity), 0.9 * kKfm.steady_Nm(velocity), 1e-4) << velocity;
  for (const double velocity : {-0.02, -0.001, 0.0, 0.0199})
    EXPECT_EQ(compensator.from_measured_Nm(velocity), 0.0) << velocity;
  EXPECT_NEAR(compensator.from_measured_Nm(0.06), 0.5 * 0.9 * kKfm.steady_Nm(0.06), 1e-4) << "half way";
}

TEST(LawCompensator, IsContinuousInBothVelocities) {
  const LawCompensator compensator(kKfm, kConfig);
  // Steepest: break-away within the blend, and the curve's own slope.
  const double slope = 0.09 / 0.08 + 0.7;
  for (int i = -20000; i < 20000; ++i) {
    const double v = 1e-4 * i, next = 1e-4 * (i + 1);
    ASSERT_LE(std::abs(compensator.from_measured_Nm(next) - compensator.from_measured_Nm(v)), slope * 1e-4)
        << v;
    for (const double other : {-0.5, 0.05, 0.5}) {
      ASSERT_LE(std::abs(compensator.from_command_Nm(next, other) - compensator.from_command_Nm(v, other)),
                slope * 1e-4);
      ASSERT_LE(std::abs(compensator.from_command_Nm(other, next) - compensator.from_command_Nm(other, v)),
                slope * 1e-4);
    }
  }
}

TEST(LawCompensator, FeedsForwardWhatIsCommandedWithinWhatFrictionTakes) {
  const LawCompensator compensator(kKfm, kConfig);
  EXPECT_NEAR(compensator.from_command_Nm(0.5, 0.5), 0.9 * kKfm.steady_Nm(0.5), 1e-4) << "as commanded";
  EXPECT_NEAR(compensator.from_command_Nm(0.5, 0.0), 0.9 * kKfm.steady_Nm(0.5), 1e-4) << "starting";
  EXPECT_NEAR(compensator.from_command_Nm(8.0, 0.0), 0.9 * kKfm.parameter("static_Nm"), 1e-4)
      << "no more than break-away before it moves";
  EXPECT_EQ(compensator.from_command_Nm(0.0, 0.5), 0.0) << "nothing wanted, nothing given";
  EXPECT_NEAR(compensator.from_command_Nm(-0.5, 0.5), -0.9 * kKfm.steady_Nm(0.5), 1e-4) << "turning round";
}

TEST(LawCompensator, FeedForwardNeverBeatsTheFrictionOfTheMeasuredMotion) {
  const LawCompensator compensator(kKfm, kConfig);
  for (double commanded = -6; commanded < 6; commanded += 0.11)
    for (double measured = -6; measured < 6; measured += 0.013) {
      const double brought = compensator.from_command_Nm(commanded, measured) * measured;
      ASSERT_LE(brought, 0.9 * std::abs(kKfm.steady_Nm(measured) * measured) + 2e-5)
          << commanded << " " << measured;
    }
}

TEST(LawCompensator, FeedForwardBringsNothingToAnOscillationAboutRest) {
  // Whatever is commanded, help · velocity over a cycle of pre-sliding is never positive.
  const LawCompensator compensator(kKfm, kConfig);
  for (const double commanded : {-1.0, 0.04, 0.5, 5.0})
    for (const double amplitude : {0.01, 0.1, 0.3}) {
      double brought = 0;
      for (int n = 0; n < 1000; ++n) {
        const double velocity = amplitude * std::sin(2 * std::numbers::pi * (n + 0.5) / 1000);
        brought += compensator.from_command_Nm(commanded, velocity) * velocity;
      }
      EXPECT_LE(brought, 1e-12) << commanded << " " << amplitude;
    }
}

TEST(LawCompensator, GainIsWhatTheMarginLeavesOfACurveItKnows) {
  // Coulomb, exactly tabled: friction/help is smallest, 1/0.8, from the blend speed on.
  const AnyLaw coulomb = make_law("coulomb", {{"coulomb_Nm", 0.05}});
  LawCompensator::Config config = kConfig;
  config.margin = 0.8;
  EXPECT_NEAR(max_passive_gain(coulomb, LawCompensator(coulomb, config)), 1.25, 1e-6);
  // A joint with 30 % less friction than was identified.
  EXPECT_NEAR(max_passive_gain(coulomb.with("coulomb_Nm", 0.035), LawCompensator(coulomb, config)), 0.875,
              1e-6);
  EXPECT_TRUE(is_passive(coulomb, LawCompensator(coulomb, config)));
  EXPECT_FALSE(is_passive(coulomb.with("coulomb_Nm", 0.035), LawCompensator(coulomb, config)));
  config.margin = 0;
  EXPECT_TRUE(std::isinf(max_passive_gain(coulomb, LawCompensator(coulomb, config))));
}

TEST(LawCompensator, InventsNoBreakAwayForALawWithoutOne) {
  const AnyLaw viscous = make_law("viscous", {{"viscous_Nm_s_per_rad", 0.5}});
  EXPECT_NEAR(max_passive_gain(viscous, LawCompensator(viscous, kConfig)), 1 / 0.9, 1e-6);
  EXPECT_EQ(LawCompensator(viscous, kConfig).from_command_Nm(0.5, 0.0), 0.0);
}

TEST(LawCompensator, FindsTheRegionNearRestWhereASpringIsTakenForSliding) {
  // Stiff pre-sliding with little damping: at 20 Hz and 0.05 rad/s the joint moves 0.4 mrad on its spring.
  const AnyLaw lugre = make_law("lugre", {{"damping_Nm_s_per_rad", 0.01}});
  LawCompensator::Config eager = kConfig;
  eager.quiet_speed_rad_per_s = 0;
  eager.blend_speed_rad_per_s = 0.01;
  EXPECT_LT(max_passive_gain(lugre, LawCompensator(lugre, eager)), 0.5);
  // Nothing like that below a tenth of a hertz, where any such speed is sliding.
  EXPECT_TRUE(is_passive(lugre, LawCompensator(lugre, eager), {10, 0.02, 0.1}));
  // And a law without pre-sliding hides it: friction is full at any speed.
  EXPECT_TRUE(is_passive(kKfm, LawCompensator(kKfm, eager)));
  // A quiet and a blend speed above the spring's speed at 20 Hz.
  LawCompensator::Config calm = kConfig;
  calm.quiet_speed_rad_per_s = 0.1;
  calm.blend_speed_rad_per_s = 0.4;
  EXPECT_TRUE(is_passive(lugre, LawCompensator(lugre, calm)));
}

TEST(LawCompensator, CompensatedJointsComeToRestFromAnySpeed) {
  // What passivity promises: no law keeps itself moving with its own compensation.
  for (const LawDescription& description : law_descriptions()) {
    const AnyLaw law = make_law(description.name);
    LawCompensator::Config calm = kConfig;
    calm.quiet_speed_rad_per_s = 0.1;
    calm.blend_speed_rad_per_s = 0.4;
    const LawCompensator compensator(law, calm);
    ASSERT_TRUE(is_passive(law, compensator))
        << description.name << " " << max_passive_gain(law, compensator);
    friction_test::Joint joint(law, 0.0107);
    joint.push(3.0);
    for (int n = 0; n < 300000; ++n) joint.step(compensator.from_measured_Nm(joint.velocity()), 1e-4);
    EXPECT_LT(std::abs(joint.velocity()), 0.1) << description.name;
  }
}

TEST(LawCompensator, GivesNothingForAVelocityThatIsNotANumber) {
  const LawCompensator compensator(kKfm, kConfig);
  EXPECT_EQ(compensator.from_measured_Nm(kNaN), 0.0);
  EXPECT_EQ(compensator.from_command_Nm(kNaN, 0.5), 0.0);
  EXPECT_EQ(compensator.from_command_Nm(0.5, kNaN), 0.0);
}

TEST(LawCompensator, RefusesMarginsThatCompensateAllAndSpeedsOutOfOrder) {
  for (const double bad : {-0.1, 1.0, 1.2, kNaN}) {
    LawCompensator::Config config = kConfig;
    config.margin = bad;
    EXPECT_THROW(LawCompensator(kKfm, config), std::invalid_argument) << bad;
  }
  for (const double bad : {0.02, 0.01, -1.0, kNaN}) {
    LawCompensator::Config config = kConfig;
    config.blend_speed_rad_per_s = bad;
    EXPECT_THROW(LawCompensator(kKfm, config), std::invalid_argument) << bad;
  }
  EXPECT_THROW(static_cast<void>(max_passive_gain(kKfm, LawCompensator(kKfm, kConfig), {10, 5, 1})),
               std::invalid_argument);
}

TEST(LawCompensator, DoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  const LawCompensator compensator(kKfm, kConfig);
  double sum = 0;
  const support::NoAllocGuard guard;
  for (int n = 0; n < 10; ++n) sum += compensator.from_measured_Nm(n) + compensator.from_command_Nm(n, 1);
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_GT(sum, 0.0);
}

}  // namespace law_compensator_test
