// Armstrong's seven parameters, one property each.
#include "model/friction/armstrong.h"

#include <gtest/gtest.h>

#include "tests/model/friction_joint.h"

namespace friction_armstrong_test {

using namespace model::friction;  // NOLINT(google-build-using-namespace)
using friction_test::Joint;
using friction_test::moved;

// Fc, e∞, vs, σ2, σ0, τL, γ
constexpr Armstrong::Parameters kParameters{0.05, 0.03, 0.1, 0.02, 200, 0.04, 0.5};

/// Breaks away and slides at `velocity` until everything has settled.
State sliding(const Armstrong& law, double velocity) {
  State state;
  for (int n = 0; n < 1000; ++n) static_cast<void>(law.step(state, {velocity, 0}, 1e-3));
  return state;
}

TEST(Armstrong, IsASpringOfItsStiffnessUpToBreakAway) {
  const Armstrong law(kParameters);
  State state;
  EXPECT_NEAR(moved(law, state, 0.39e-3, 1e-4, 10), 200 * 0.39e-3 + 0.02 * 1e-4, 1e-12);
  EXPECT_NEAR(moved(law, state, -0.39e-3, 1e-4, 10), -0.02 * 1e-4, 1e-12);
  EXPECT_NEAR(moved(law, state, 0.41e-3, 1e-4, 1000), 0.08, 1e-5) << "Fc + e∞ after a long rest";
}

TEST(Armstrong, SlidesOnItsLorentzianStribeckCurve) {
  const Armstrong law(kParameters);
  for (const double velocity : {-0.3, 0.05, 0.1, 2.0}) {
    State state = sliding(law, velocity);
    const double level = 0.05 + 0.03 / (1 + velocity * velocity / 0.01);
    EXPECT_NEAR(law.step(state, {velocity, 0}, 1e-3), std::copysign(level, velocity) + 0.02 * velocity,
                1e-12);
  }
  EXPECT_NEAR(law.steady_Nm(0.1), 0.05 + 0.015 + 0.002, 1e-15);
  EXPECT_NEAR(law.steady_Nm(-0.0), -0.08, 1e-15);
}

TEST(Armstrong, RemembersTheVelocityForItsMemoryTime) {
  const Armstrong law(kParameters);
  State state = sliding(law, 0.1);
  const double old_share = 0.5, new_share = 1.0 / (1 + 9);
  const auto stribeck = [&](double velocity) {  // the rest without Fc and σ2, in units of e∞
    return (law.step(state, {velocity, 0}, 1e-4) - 0.05 - 0.02 * velocity) / 0.03;
  };
  for (int n = 0; n < 395; ++n) ASSERT_NEAR(stribeck(0.3), old_share, 1e-9) << "still, " << n << " steps on";
  for (int n = 395; n < 460; ++n) static_cast<void>(stribeck(0.3));  // arrives within τL/8 = 5 ms and a step
  EXPECT_NEAR(stribeck(0.3), new_share, 1e-9);
}

TEST(Armstrong, BreakAwayRisesWithTheTimeAtRest) {
  const Armstrong law(kParameters);
  for (const double rest : {0.1, 0.5, 2.0, 50.0}) {
    State state = sliding(law, 0.2);
    // Arrested at 0.2 rad/s: e₀ = e∞/(1 + 4). Then e = e∞ − (e∞ − e₀)·γ/(t + γ).
    const double expected = 0.05 + 0.03 - (0.03 - 0.006) * 0.5 / (rest + 0.5);
    static_cast<void>(law.step(state, {0, 0}, rest));
    double highest = 0;  // pulled away fast against γ, slowly against the break-away's step
    for (int n = 0; n < 2000; ++n) highest = std::max(highest, law.step(state, {0.1, 0}, 1e-6) - 0.02 * 0.1);
    EXPECT_NEAR(highest, expected, 2e-4) << rest;  // 2 ms of dwell at most in the pulling
  }
}

TEST(Armstrong, TakesOverWithoutAJumpWhenSlidingEnds) {
  const Armstrong law(kParameters);
  State state = sliding(law, 0.2);
  const double before = law.step(state, {0.2, 0}, 1e-6) - 0.02 * 0.2;
  EXPECT_NEAR(law.step(state, {-1e-6, 0}, 1e-6), before, 1e-7);
  EXPECT_NEAR(law.step(state, {-1.0, 0}, 1e-4), before - 200e-4 - 0.02, 1e-7) << "the spring is relieved";
}

TEST(Armstrong, SticksWithoutDriftUnderASwingingLoad) {
  // Viscous friction damps the spring; 0.2 to 0.8 of break-away.
  Joint joint(Armstrong(kParameters), 0.01);
  for (int n = 0; n < 100000; ++n)
    joint.step(0.08 * std::min(1.0, 2e-5 * n) * (0.5 + 0.3 * std::sin(2e-4 * n)), 1e-4);
  EXPECT_NEAR(joint.position(), 0.08 * (0.5 + 0.3 * std::sin(20.0)) / 200, 1e-6);
}

TEST(Armstrong, WithoutMemoryAndDwellTheyAreGone) {
  const Armstrong law({0.05, 0.03, 0.1, 0.0, 200, 0.0, 0.0});
  State state = sliding(law, 0.2);
  EXPECT_NEAR(law.step(state, {0.1, 0}, 1e-3), 0.065, 1e-15) << "at once";
  static_cast<void>(law.step(state, {0, 0}, 1e-3));
  double highest = 0;
  for (int n = 0; n < 1000; ++n) highest = std::max(highest, law.step(state, {0.01, 0}, 1e-5));
  EXPECT_NEAR(highest, 0.08, 5e-4) << "break-away after any rest; b(0.01) = 0.99";
}

}  // namespace friction_armstrong_test
