// The bounded bristle, the element for sticking.
#include "sim/bounded_bristle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bounded_bristle_test {

using sim::BoundedBristle;

TEST(BoundedBristle, IsASpringBelowItsBound) {
  BoundedBristle bristle({.stiffness = 250, .damping = 0});
  // 1e-4 rad at 250 N·m/rad: 0.025 N·m, the torque of the thesis' first table of micro-displacements.
  double force = 0;
  for (int i = 0; i < 100; ++i) force = bristle.step(1e-3, 0.1, 1e-3);
  EXPECT_NEAR(force, 0.025, 1e-15);
  EXPECT_NEAR(bristle.deflection(), 1e-4, 1e-18);
}

TEST(BoundedBristle, IsADamperOnTop) {
  BoundedBristle bristle({.stiffness = 250, .damping = 0.127});
  EXPECT_NEAR(bristle.step(0.1, 1.0, 1e-6), 250 * 1e-7 + 0.127 * 0.1, 1e-15);
}

TEST(BoundedBristle, SlidingIsExactlyTheBoundInEitherDirection) {
  BoundedBristle bristle({.stiffness = 250, .damping = 0.127});
  for (const double velocity : {0.5, 3.0, -0.2, -10.0, 1.0}) {
    double force = 0;
    for (int i = 0; i < 1000; ++i) force = bristle.step(velocity, 0.08, 1e-3);
    EXPECT_EQ(force, std::copysign(0.08, velocity));
    EXPECT_NEAR(bristle.deflection(), std::copysign(0.08 / 250, velocity), 1e-18);
  }
}

TEST(BoundedBristle, NeverExceedsItsBoundNotEvenWithItsDamper) {
  BoundedBristle bristle({.stiffness = 250, .damping = 10});
  for (int i = 0; i < 1000; ++i) {
    const double velocity = 5 * std::sin(0.1 * i);
    const double bound = 0.05 + 0.04 * std::cos(0.37 * i);
    ASSERT_LE(std::abs(bristle.step(velocity, bound, 1e-3)), bound);
  }
}

TEST(BoundedBristle, FollowsABoundThatFallsWhileItSlides) {
  BoundedBristle bristle({.stiffness = 250, .damping = 0});
  for (int i = 0; i < 100; ++i) static_cast<void>(bristle.step(1.0, 0.1, 1e-3));
  EXPECT_EQ(bristle.step(1.0, 0.06, 1e-3), 0.06);
  EXPECT_EQ(bristle.step(1.0, 0.0, 1e-3), 0.0);
  EXPECT_EQ(bristle.deflection(), 0.0);
}

TEST(BoundedBristle, AfterAReversalItGivesBackItsDeflectionFirst) {
  // Sliding at +bound, reversal: −bound only after 2·bound/σ0 of travel (Masing).
  BoundedBristle bristle({.stiffness = 250, .damping = 0});
  for (int i = 0; i < 1000; ++i) static_cast<void>(bristle.step(1.0, 0.1, 1e-3));
  double travel = 0, force = 0.1;
  while (force > -0.1 && travel < 1) {
    force = bristle.step(-1.0, 0.1, 1e-6);
    travel += 1e-6;
    ASSERT_NEAR(force, std::max(-0.1, 0.1 - 250 * travel), 1e-12);
  }
  EXPECT_NEAR(travel, 2 * 0.1 / 250, 2e-6);
}

TEST(BoundedBristle, IsExactForAConstantVelocityWhateverTheStep) {
  for (const int steps : {1, 3, 1000}) {
    BoundedBristle bristle({.stiffness = 250, .damping = 0.127});
    double force = 0;
    for (int i = 0; i < steps; ++i) force = bristle.step(0.01, 1.0, 1e-2 / steps);
    EXPECT_NEAR(force, 250 * 0.01 * 1e-2 + 0.127 * 0.01, 1e-15) << steps;
  }
}

TEST(BoundedBristle, NoClosedMotionGainsEnergyFromIt) {
  // Rate-independent friction is passive: over a closed cycle of position the force takes work.
  BoundedBristle bristle({.stiffness = 250, .damping = 0.127});
  for (const double amplitude : {1e-5, 1e-4, 1e-3, 1e-1}) {  // sticking, creeping round the corner, sliding
    double work = 0;
    constexpr double kStep_s = 1e-4;
    for (int i = 0; i < 20000; ++i) {  // two cycles of 1 s
      const double velocity = amplitude * 2 * std::numbers::pi * std::cos(2 * std::numbers::pi * kStep_s * i);
      const double force = bristle.step(velocity, 0.08, kStep_s);
      if (i >= 10000) work += force * velocity * kStep_s;
    }
    EXPECT_GT(work, 0) << amplitude;
    // While it slides: four quarters of travel at the bound, less the two elastic returns of 2·bound/σ0.
    const double sliding = 4 * 0.08 * (amplitude - 0.08 / 250);
    if (amplitude > 1e-2) {
      EXPECT_NEAR(work, sliding, 0.01 * sliding);
    }
  }
}

TEST(BoundedBristle, BendsOverAsLuGresDoes) {
  BoundedBristle bristle({.stiffness = 250, .damping = 0, .exponent = 1});
  double force = 0;
  // From rest, 3 mrad:  F = Fc·(1 − exp(−σ0·x/Fc)).
  for (int i = 0; i < 30; ++i) force = bristle.step(0.1, 0.1, 1e-3);
  EXPECT_NEAR(force, 0.1 * (1 - std::exp(-7.5)), 1e-14);
  // The level sinks by half: the excess fades over the same kind of way.
  const double excess = force - 0.05;
  for (int i = 0; i < 4; ++i) force = bristle.step(0.1, 0.05, 1e-3);
  EXPECT_NEAR(force, 0.05 + excess * std::exp(-250 * 4e-4 / 0.05), 1e-14);
  // Back: from F₀ towards −Fc.
  const double turned = force;
  for (int i = 0; i < 5; ++i) force = bristle.step(-0.1, 0.05, 1e-3);
  EXPECT_NEAR(force, -0.05 + (turned + 0.05) * std::exp(-250 * 5e-4 / 0.05), 1e-14);
}

TEST(BoundedBristle, BentOverItsDamperWorksOnItsDeflection) {
  BoundedBristle bristle({.stiffness = 250, .damping = 2, .exponent = 1});
  // At first the deflection moves with the joint; sliding it rests.
  EXPECT_NEAR(bristle.step(0.1, 1.0, 1e-7), 2 * 0.1, 1e-5);
  double force = 0;
  for (int i = 0; i < 1000; ++i) force = bristle.step(0.1, 0.1, 1e-3);
  EXPECT_NEAR(force, 0.1, 1e-12);
}

TEST(BoundedBristle, ASmallExponentIsNearlyNone) {
  BoundedBristle straight({.stiffness = 250, .damping = 0});
  BoundedBristle bent({.stiffness = 250, .damping = 0, .exponent = 1e-6});
  for (int i = 0; i < 2000; ++i) {
    const double velocity = 0.5 * std::sin(0.05 * i);
    const double bound = 0.08 + 0.03 * std::cos(0.017 * i);
    ASSERT_NEAR(straight.step(velocity, bound, 1e-3), bent.step(velocity, bound, 1e-3), 1e-4) << i;
  }
}

}  // namespace bounded_bristle_test
