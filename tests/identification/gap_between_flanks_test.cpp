/// Motor and load on the flanks of a gap, compared with mechanics calculated by hand.
#include "identification/gap/between_flanks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace identification::gap {
namespace gap_between_flanks_test {

constexpr double kInertia = 0.01;
constexpr double kShare = 0.4;
constexpr double kBounce_s = 4e-3;
constexpr Levels kNoFriction{0, 0};

model::effects::Mechanics gap(double loss_s_per_rad) {
  return {.inertia_kg_m2 = kInertia,
          .backlash_rad = 0.01,
          .load_share = kShare,
          .flank_loss_s_per_rad = loss_s_per_rad};
}

/// Steps until motor and load are in contact, at most `longest_s`; returns the flanks' impulse on the load.
double bounce(BetweenFlanks& masses, const model::effects::Mechanics& mechanics,
              const BetweenFlanks::Push& push, double longest_s) {
  const double step_s = BetweenFlanks::longest_step_s(mechanics);
  double flank = 0;
  for (double t = 0; t < longest_s && !masses.in_contact(); t += step_s)
    flank += masses.bounce(push, kNoFriction, step_s).flank;
  return flank;
}

// Hunt and Crossley: what meets at v parts with (1 − α·v)·v. A motor that is pushed for a moment meets a load
// at rest.
TEST(BetweenFlanks, AnImpactKeepsItsMomentumAndLosesWhatItSays) {
  for (const double loss : {0.0, 1.0}) {
    const model::effects::Mechanics mechanics = gap(loss);
    BetweenFlanks masses(mechanics, kBounce_s, 0, 0);
    const double step_s = BetweenFlanks::longest_step_s(mechanics);
    const double closing = 0.1;
    masses.bounce({(1 - kShare) * kInertia * closing / step_s, 0, 0}, kNoFriction, step_s);
    ASSERT_NEAR(masses.motor_rad_per_s(), closing, 1e-12);
    const double flank = bounce(masses, mechanics, {0, 0, 0}, 0.08);  // there, and half of the way back
    EXPECT_NEAR(masses.load_rad_per_s() - masses.motor_rad_per_s(), (1 - loss * closing) * closing,
                0.03 * closing)
        << loss;
    EXPECT_NEAR((1 - kShare) * masses.motor_rad_per_s() + kShare * masses.load_rad_per_s(),
                (1 - kShare) * closing, 1e-12);
    EXPECT_NEAR(flank, kShare * kInertia * masses.load_rad_per_s(), 1e-12);
    EXPECT_FALSE(masses.in_contact());
  }
}

// A spring with a damper that never pulls: the restitution is the same at each speed, within the size of the
// steps. [T. Schwager, T. Pöschel, Granular Matter 9:465, 2007, eq. 21]
TEST(BetweenFlanks, ADampedFlankLosesTheSameShareAtEachSpeed) {
  for (const double ratio : {0.1, 0.5})
    for (const double closing : {0.05, 0.4}) {
      model::effects::Mechanics mechanics = gap(0);
      mechanics.flank_damping_ratio = ratio;
      BetweenFlanks masses(mechanics, 1e-6, 0, 0);
      const double step_s = BetweenFlanks::longest_step_s(mechanics);
      masses.bounce({(1 - kShare) * kInertia * closing / step_s, 0, 0}, kNoFriction, step_s);
      bounce(masses, mechanics, {0, 0, 0}, 0.008 / closing);  // there, and most of the way back
      const double damped = std::sqrt(1 - ratio * ratio);
      const double touching = std::numbers::pi - std::atan(2 * ratio * damped / (1 - 2 * ratio * ratio));
      const double restitution = std::exp(-ratio / damped * touching);
      EXPECT_NEAR((masses.load_rad_per_s() - masses.motor_rad_per_s()) / closing, restitution, 0.07)
          << ratio << " at " << closing;
    }
}

TEST(BetweenFlanks, WhatIsPressedTogetherMovesAsOneMass) {
  const model::effects::Mechanics mechanics = gap(5);
  BetweenFlanks masses(mechanics, kBounce_s, 0, 0);
  const BetweenFlanks::Push push{0.05, 0, 0};
  double flank = bounce(masses, mechanics, push, 3);
  ASSERT_TRUE(masses.in_contact());
  const double before = masses.motor_rad_per_s();
  ASSERT_TRUE(masses.keeps_contact(push, kNoFriction, 0.1));
  flank += masses.step_in_contact(push, kNoFriction, 0.1).flank;
  EXPECT_NEAR(masses.motor_rad_per_s() - before, 0.1 * 0.05 / kInertia, 1e-12);
  EXPECT_EQ(masses.load_rad_per_s(), masses.motor_rad_per_s());
  // By the gap, and by how much the flank gives.
  EXPECT_NEAR(masses.twist_rad(), 0.005 + kShare * 0.05 / mechanics.flank_Nm_per_rad(), 1e-12);
  EXPECT_NEAR(flank, kShare * kInertia * masses.load_rad_per_s(), 1e-9);
}

// Friction of 0.05 N·m, of which the load has two fifths: it stops a load that coasts, and holds the motor.
TEST(BetweenFlanks, ALoadLeavesTheFlankOnceItsMotorSlowsDownFaster) {
  const model::effects::Mechanics mechanics = gap(5);
  const Levels level{0.05, 0.05};
  BetweenFlanks masses(mechanics, kBounce_s, 0, 0);
  const double step_s = BetweenFlanks::longest_step_s(mechanics);
  for (double t = 0; t < 3 && !masses.in_contact(); t += step_s) masses.bounce({0.15, 0, 0}, level, step_s);
  ASSERT_TRUE(masses.in_contact());
  // By friction alone both slow down alike.
  EXPECT_TRUE(masses.keeps_contact({0.01, 0, 0}, level, 2e-3));
  EXPECT_FALSE(masses.keeps_contact({-0.01, 0, 0}, level, 2e-3));
  EXPECT_FALSE(masses.in_contact());
  EXPECT_NEAR(masses.twist_rad(), 0.005, 1e-12);
}

}  // namespace gap_between_flanks_test
}  // namespace identification::gap
