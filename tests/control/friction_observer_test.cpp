// Friction from position alone.
#include "control/friction_observer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "tests/support/no_alloc_guard.h"

namespace friction_observer_test {

using control::FrictionEstimate;
using control::FrictionObserver;
using model::friction::SlidingTable;

constexpr double kPeriod_s = 1e-3;

/// 0.05 N·m forward, 0.08 N·m backward.
SlidingTable asymmetric_coulomb() {
  return {[](double v) { return std::signbit(v) ? -0.08 : 0.05; }, {0.02, 10.0, 0.0}};
}

/// The estimate after a second at constant velocity.
FrictionEstimate at_velocity(FrictionObserver& observer, double velocity_rad_per_s) {
  observer.reset(0.0);
  FrictionEstimate estimate;
  for (int k = 0; k < 1000; ++k) estimate = observer.step(velocity_rad_per_s * kPeriod_s * k);
  return estimate;
}

// The filter is exact for a ramp; the difference is its transient.
constexpr double kSlope = 0.002;

TEST(FrictionObserver, IsTheSlidingFrictionOfTheDirectionOfMotion) {
  FrictionObserver observer(asymmetric_coulomb(), {});
  const FrictionEstimate forward = at_velocity(observer, 2.0);
  EXPECT_NEAR(forward.velocity_rad_per_s, 2.0, 2.0 * kSlope);
  EXPECT_NEAR(forward.friction_Nm, 0.05, 1e-12);
  EXPECT_EQ(forward.rest, 0.0);
  const FrictionEstimate backward = at_velocity(observer, -2.0);
  EXPECT_NEAR(backward.velocity_rad_per_s, -2.0, 2.0 * kSlope);
  EXPECT_NEAR(backward.friction_Nm, -0.08, 1e-12);
  EXPECT_EQ(backward.rest, 0.0);
}

TEST(FrictionObserver, LooksTheCurveUpAtItsVelocity) {
  FrictionObserver observer({[](double v) { return 0.02 + 0.01 * std::abs(v); }, {0.02, 10.0, 0.0}}, {});
  for (const double v : {-7.0, -1.0, 0.3, 5.0})
    EXPECT_NEAR(at_velocity(observer, v).friction_Nm, std::copysign(0.02 + 0.01 * std::abs(v), v),
                0.15 * kSlope);
}

TEST(FrictionObserver, FadesLinearlyTowardsRestBelowTheBlendSpeed) {
  FrictionObserver observer(asymmetric_coulomb(), {.filter = {}, .blend_speed_rad_per_s = 0.1});
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const FrictionEstimate forward = at_velocity(observer, share * 0.1);
    EXPECT_NEAR(forward.friction_Nm, share * 0.05, 0.05 * kSlope);
    EXPECT_NEAR(forward.rest, 1 - share, kSlope);
    const FrictionEstimate backward = at_velocity(observer, -share * 0.1);
    EXPECT_NEAR(backward.friction_Nm, -share * 0.08, 0.08 * kSlope);
    EXPECT_NEAR(backward.rest, 1 - share, kSlope);
  }
}

TEST(FrictionObserver, IsContinuousThroughZeroVelocity) {
  FrictionObserver observer(asymmetric_coulomb(), {});
  observer.reset(0.0);
  FrictionEstimate last = observer.step(0.0);
  double lowest = 1, highest = -1;
  for (int k = 1; k < 4000; ++k) {  // swings between about ±0.5 rad/s
    const FrictionEstimate estimate = observer.step(0.1 * (1 - std::cos(5 * kPeriod_s * k)));
    const double change = std::abs(estimate.velocity_rad_per_s - last.velocity_rad_per_s);
    // Slope of the fade: 0.08 N·m over the blend speed of 0.05 rad/s; of the rest share 1 over it.
    ASSERT_LE(std::abs(estimate.friction_Nm - last.friction_Nm), 0.08 / 0.05 * change + 1e-15);
    ASSERT_LE(std::abs(estimate.rest - last.rest), 1 / 0.05 * change + 1e-15);
    lowest = std::min(lowest, estimate.friction_Nm);
    highest = std::max(highest, estimate.friction_Nm);
    last = estimate;
  }
  EXPECT_NEAR(lowest, -0.08, 1e-12);  // both directions were seen
  EXPECT_NEAR(highest, 0.05, 1e-12);
}

TEST(FrictionObserver, KnowsNoFrictionAndFullRestAtStandstillWhereverItStands) {
  FrictionObserver observer(asymmetric_coulomb(), {});
  FrictionEstimate estimate = observer.step(98765.4);  // never reset: the first position counts
  EXPECT_NEAR(estimate.friction_Nm, 0.0, 1e-9);
  EXPECT_NEAR(estimate.rest, 1.0, 1e-6);
  observer.reset(-3.0);
  estimate = observer.step(-3.0);
  EXPECT_NEAR(estimate.friction_Nm, 0.0, 1e-12);
  EXPECT_NEAR(estimate.rest, 1.0, 1e-12);
}

TEST(FrictionObserver, BreakAwayIsThatOfTheTable) {
  const FrictionObserver observer(asymmetric_coulomb(), {});
  EXPECT_NEAR(observer.holding_Nm(0, 1), 0.05, 1e-15);
  EXPECT_NEAR(observer.holding_Nm(0, -1), 0.08, 1e-15);
}

TEST(FrictionObserver, OneEncoderTickIsNotTakenForMotion) {
  FrictionObserver observer(asymmetric_coulomb(), {});
  observer.reset(0.0);
  double largest_Nm = 0;
  for (int k = 0; k < 200; ++k) largest_Nm = std::max(largest_Nm, observer.step(6.08e-5).friction_Nm);
  // 3 mrad/s of 50 mrad/s blend speed: 6 % of the friction.
  EXPECT_LT(largest_Nm, 0.07 * 0.05);
}

TEST(FrictionObserver, RefusesABlendSpeedThatIsNotPositive) {
  for (const double bad : {0.0, -0.05, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(FrictionObserver(asymmetric_coulomb(), {.filter = {}, .blend_speed_rad_per_s = bad}),
                 std::invalid_argument);
  EXPECT_THROW(
      FrictionObserver(asymmetric_coulomb(), {.filter = {.damping = 0}, .blend_speed_rad_per_s = 0.05}),
      std::invalid_argument);
}

TEST(FrictionObserver, StepDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  FrictionObserver observer(model::friction::wheel_table(1), {});
  double sum = 0;
  const support::NoAllocGuard guard;
  for (int i = 0; i < 10; ++i) sum += observer.step(0.01 * i).friction_Nm;
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_GT(sum, 0.0);
}

}  // namespace friction_observer_test
