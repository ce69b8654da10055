// The friction added to a command, and especially the friction not added.
#include "control/friction_compensator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "tests/support/no_alloc_guard.h"

namespace friction_compensator_test {

using control::FrictionCompensator;
using control::FrictionEstimate;
using control::FrictionObserver;
using model::friction::SlidingTable;
using model::friction::wheel_table;

constexpr double kMargin = 0.9;
constexpr double kFull_Nm = 0.01;
constexpr FrictionCompensator::Config kConfig{.margin = kMargin, .full_command_Nm = kFull_Nm};
constexpr double kBlend_rad_per_s = 0.05;  // FrictionObserver's default

/// 0.05 N·m forward, 0.08 N·m backward.
SlidingTable asymmetric_coulomb() {
  return {[](double v) { return std::signbit(v) ? -0.08 : 0.05; }, {0.02, 10.0, 0.0}};
}

/// Carries a joint through velocities −0.3 … 0.3 rad/s and back and hands every estimate on.
template <class See>
void sweep_velocity(FrictionObserver& observer, const See& see) {
  double position_rad = 0, velocity_rad_per_s = -0.3;
  observer.reset(position_rad);
  for (int k = 0; k < 500; ++k)  // the filter's transient
    static_cast<void>(observer.step(position_rad += 1e-3 * velocity_rad_per_s));
  for (int k = -12000; k < 12000; ++k) {
    velocity_rad_per_s = k < 0 ? -0.3 + 0.05e-3 * (k + 12000) : 0.3 - 0.05e-3 * k;
    see(observer.step(position_rad += 1e-3 * velocity_rad_per_s));
  }
}

class FrictionCompensatorTest : public testing::Test {
 protected:
  double torque_Nm(double command_Nm, const FrictionEstimate& estimate) const {
    return compensator.torque_Nm(command_Nm, estimate, observer);
  }
  const FrictionCompensator compensator{kConfig};
  const FrictionObserver observer{asymmetric_coulomb(), {}};
  const FrictionEstimate at_rest{0, 0, 1};
  const FrictionEstimate forward{1.0, 0.05, 0};
  const FrictionEstimate backward{-1.0, -0.08, 0};
};

TEST_F(FrictionCompensatorTest, WithoutACommandItIsZeroAtAnyVelocity) {
  EXPECT_EQ(torque_Nm(0.0, at_rest), 0.0);
  EXPECT_EQ(torque_Nm(0.0, forward), 0.0);
  EXPECT_EQ(torque_Nm(0.0, backward), 0.0);
  EXPECT_EQ(torque_Nm(-0.0, {0.02, 0.02, 0.6}), 0.0);
}

TEST_F(FrictionCompensatorTest, AtRestItHelpsBreakAwayInTheDirectionOfTheCommand) {
  EXPECT_NEAR(torque_Nm(+kFull_Nm, at_rest), +kMargin * 0.05, 1e-15);
  EXPECT_NEAR(torque_Nm(-kFull_Nm, at_rest), -kMargin * 0.08, 1e-15);
  EXPECT_NEAR(torque_Nm(+1.0, at_rest), +kMargin * 0.05, 1e-15);
  EXPECT_NEAR(torque_Nm(-1.0, at_rest), -kMargin * 0.08, 1e-15);
}

TEST_F(FrictionCompensatorTest, InMotionItCompensatesTheFrictionOfTheMotionWhateverTheCommandsSign) {
  for (const double command_Nm : {-1.0, -0.1, 0.1, 1.0}) {
    EXPECT_NEAR(torque_Nm(command_Nm, forward), +kMargin * 0.05, 1e-15) << command_Nm;
    EXPECT_NEAR(torque_Nm(command_Nm, backward), -kMargin * 0.08, 1e-15) << command_Nm;
  }
  EXPECT_NEAR(torque_Nm(+kFull_Nm, forward), +kMargin * 0.05, 1e-15);
  EXPECT_NEAR(torque_Nm(-kFull_Nm, backward), -kMargin * 0.08, 1e-15);
}

TEST_F(FrictionCompensatorTest, NeverTurnsACommandRoundHoweverWrongTheModelIs) {
  // Against the motion by less than friction: left to friction.
  EXPECT_EQ(torque_Nm(-kFull_Nm, forward), +kFull_Nm);
  EXPECT_EQ(torque_Nm(+0.03, backward), -0.03);
  const FrictionObserver mad({[](double v) { return std::copysign(50.0, v); }, {0.02, 10.0, 0.0}}, {});
  for (const double velocity : {-3.0, -0.03, 0.0, 0.03, 3.0})
    for (const double position_Nm : {-20.0, 0.0, 20.0})
      for (const double command_Nm : {-100.0, -1.0, -1e-3, -1e-9, 0.0, 1e-9, 1e-3, 1.0, 100.0}) {
        const double direction = std::clamp(velocity / kBlend_rad_per_s, -1.0, 1.0);
        const FrictionEstimate estimate{velocity, 50 * direction, 1 - std::abs(direction), position_Nm};
        const double help_Nm = compensator.torque_Nm(command_Nm, estimate, mad);
        EXPECT_GE((command_Nm + help_Nm) * command_Nm, 0) << command_Nm << " at " << velocity;
      }
  EXPECT_TRUE(std::isnan(torque_Nm(std::nan(""), forward))) << "for the robot to refuse";
  EXPECT_TRUE(std::isnan(torque_Nm(0.1, {std::nan(""), std::nan(""), std::nan("")})));
}

TEST_F(FrictionCompensatorTest, ASmallCommandGetsItsShare) {
  EXPECT_NEAR(torque_Nm(0.5 * kFull_Nm, at_rest), 0.5 * kMargin * 0.05, 1e-15);
  EXPECT_NEAR(torque_Nm(-0.25 * kFull_Nm, at_rest), -0.25 * kMargin * 0.08, 1e-15);
  EXPECT_NEAR(torque_Nm(0.25 * kFull_Nm, forward), 0.25 * kMargin * 0.05, 1e-15);
}

TEST_F(FrictionCompensatorTest, BetweenRestAndMotionBothSharesAdd) {
  // Half way up the blend: half of the sliding friction, half of the break-away torque.
  const FrictionEstimate slow{0.025, 0.025, 0.5};
  EXPECT_NEAR(torque_Nm(+kFull_Nm, slow), kMargin * (0.025 + 0.025), 1e-15);
  EXPECT_NEAR(torque_Nm(-kFull_Nm, slow), kMargin * (0.025 - 0.04), 1e-15);  // about to turn round
}

TEST_F(FrictionCompensatorTest, NeverHelpsByMoreThanTheFrictionOfTheSpeedWhateverTheBlendSpeed) {
  // Measured curves fall from break-away to a third less within 0.3 rad/s: inside a wide blend the break-away
  // torque would drive the wheel.
  for (int wheel = 1; wheel <= 4; ++wheel)
    for (const double blend_rad_per_s : {0.01, 0.05, 0.2, 1.0})
      for (double velocity = 0.001; velocity < 1.2; velocity += 0.003) {
        FrictionObserver::Config config;
        config.blend_speed_rad_per_s = blend_rad_per_s;
        const model::friction::SlidingTable table = model::friction::wheel_table(wheel);
        const FrictionObserver wheel_observer(table, config);
        const double direction = std::min(velocity / blend_rad_per_s, 1.0);
        const FrictionEstimate estimate{velocity, direction * table.level_Nm(velocity), 1 - direction};
        ASSERT_LE(compensator.torque_Nm(1.0, estimate, wheel_observer),
                  kMargin * table.level_Nm(velocity) + 1e-15)
            << "wheel " << wheel << " at " << velocity << " rad/s, blend " << blend_rad_per_s;
      }
}

TEST_F(FrictionCompensatorTest, ZeroMarginSwitchesItOff) {
  const FrictionCompensator off({.margin = 0});
  EXPECT_EQ(off.torque_Nm(1.0, at_rest, observer), 0.0);
  EXPECT_EQ(off.torque_Nm(1.0, forward, observer), 0.0);
}

TEST_F(FrictionCompensatorTest, IsContinuousInTheCommand) {
  constexpr double kStep_Nm = 1e-6;
  for (const FrictionEstimate& estimate : {at_rest, forward, backward, FrictionEstimate{0.025, 0.025, 0.5},
                                           FrictionEstimate{-0.02, -0.032, 0.6}}) {
    double last_Nm = torque_Nm(-0.02, estimate);
    for (int i = -20000; i <= 20000; ++i) {
      const double now_Nm = torque_Nm(kStep_Nm * i, estimate);
      // Steepest: sliding and break-away shares of at most 0.08 N·m each, reached within c_full.
      ASSERT_LE(std::abs(now_Nm - last_Nm), kMargin * 2 * 0.08 / kFull_Nm * kStep_Nm * (1 + 1e-9)) << i;
      last_Nm = now_Nm;
    }
  }
}

TEST_F(FrictionCompensatorTest, IsContinuousInTheVelocityThroughRestAndReversal) {
  for (const double command_Nm : {-1.0, -0.004, 0.004, 1.0}) {
    FrictionObserver moving(asymmetric_coulomb(), {});
    double last_Nm = 0, last_rad_per_s = 0;
    bool first = true;
    sweep_velocity(moving, [&](const FrictionEstimate& estimate) {
      const double now_Nm = compensator.torque_Nm(command_Nm, estimate, moving);
      if (!first) {
        // Steepest: both shares of at most 0.08 N·m fade within the blend speed.
        EXPECT_LE(std::abs(now_Nm - last_Nm), kMargin * 2 * 0.08 / kBlend_rad_per_s *
                                                      std::abs(estimate.velocity_rad_per_s - last_rad_per_s) +
                                                  1e-15);
      }
      first = false;
      last_Nm = now_Nm;
      last_rad_per_s = estimate.velocity_rad_per_s;
    });
  }
}

TEST(FrictionCompensatorOnWheels, NeverExceedsTheMarginOfTheLargestFrictionThere) {
  for (int wheel = 1; wheel <= 4; ++wheel) {
    FrictionObserver observer(wheel_table(wheel), {});
    const SlidingTable table = wheel_table(wheel);
    const FrictionCompensator compensator(kConfig);
    double largest_Nm = 0;
    sweep_velocity(observer, [&](const FrictionEstimate& estimate) {
      const double v = estimate.velocity_rad_per_s;
      const double bound_Nm =
          kMargin * std::max(table.level_Nm(v), estimate.rest > 0 ? table.breakaway_Nm(v) : 0.0);
      for (const double command_Nm : {-100.0, -0.01, -0.003, 0.0, 0.003, 0.01, 100.0}) {
        const double added_Nm = compensator.torque_Nm(command_Nm, estimate, observer);
        EXPECT_LE(std::abs(added_Nm), bound_Nm + 1e-12) << "wheel " << wheel << " at " << v;
        largest_Nm = std::max(largest_Nm, std::abs(added_Nm));
      }
    });
    EXPECT_GT(largest_Nm, 0.95 * kMargin * table.breakaway_Nm(1)) << "the bound is reached";
  }
}

TEST(FrictionCompensatorOnWheels, TakesLessThanAWheelsFrictionFromAMovingWheelSoItNeverDrivesIt) {
  // Power of the compensation against power of the true friction: the plant's finer table of the same curve.
  for (int wheel = 1; wheel <= 4; ++wheel) {
    FrictionObserver observer(wheel_table(wheel), {});
    const SlidingTable truth = wheel_table(wheel, {.spacing_rad_per_s = 0.005});
    const FrictionCompensator compensator(FrictionCompensator::Config{});  // the default margin of 0.95
    sweep_velocity(observer, [&](const FrictionEstimate& estimate) {
      const double v = estimate.velocity_rad_per_s;
      for (const double command_Nm : {-1.0, -0.003, 0.003, 1.0})
        EXPECT_LE(compensator.torque_Nm(command_Nm, estimate, observer) * v,
                  truth.level_Nm(v) * std::abs(v) + 1e-15)
            << "wheel " << wheel << " at " << v << " commanded " << command_Nm;
    });
  }
}

TEST(FrictionCompensator, RefusesMarginsAndCommandsOutOfRange) {
  for (const double bad : {-0.01, 1.01, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(FrictionCompensator({.margin = bad}), std::invalid_argument) << bad;
  for (const double bad : {0.0, -0.01, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(FrictionCompensator({.full_command_Nm = bad}), std::invalid_argument) << bad;
  EXPECT_NO_THROW(FrictionCompensator({.margin = 1}));
}

TEST(FrictionCompensator, DoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  const FrictionObserver observer(wheel_table(1), {});
  const FrictionCompensator compensator(kConfig);
  double sum = 0;
  const support::NoAllocGuard guard;
  for (int i = 1; i <= 10; ++i) sum += compensator.torque_Nm(0.01 * i, {0, 0, 1}, observer);
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_GT(sum, 0.0);
}

}  // namespace friction_compensator_test
