// The hand on the master: a mass, a spring and a damper, checked against their closed forms.
#include "sim/hand.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/support/no_alloc_guard.h"

namespace {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using sim::Hand;
using sim::HandParameters;

constexpr HandParameters kHand{.device_mass_kg = 0.3,
                               .device_drag_N_s_per_m = 0.5,
                               .hand_mass_kg = 0.5,
                               .hand_stiffness_N_per_m = 300,
                               .hand_damping_N_s_per_m = 12};

hal::HapticSample measured(Hand& hand) {
  hal::HapticSample sample;
  hand.measure(sample);
  return sample;
}

TEST(Hand, YieldsByForceOverStiffness) {
  Hand hand(kHand);
  hand.advance({3, 0, -6}, 4s);  // damped by e^(−7.8·t)
  EXPECT_TRUE(measured(hand).p_HD_m.isApprox(Vector3d(0.01, 0, -0.02), 1e-9))
      << measured(hand).p_HD_m.transpose();
  EXPECT_NEAR(measured(hand).v_HD_H_m_per_s.norm(), 0.0, 1e-9);
}

TEST(Hand, GoesToWhereItMeansToBe) {
  Hand hand(kHand);
  hand.hold_at({0.1, -0.05, 0.02});
  hand.advance(Vector3d::Zero(), 4s);
  EXPECT_TRUE(measured(hand).p_HD_m.isApprox(Vector3d(0.1, -0.05, 0.02), 1e-9));
}

TEST(Hand, ReachesWithTheSpeedOfLeastJerk) {
  // Stiff and without inertia to speak of, so that it is where it means to be.
  HandParameters stiff = kHand;
  stiff.hand_stiffness_N_per_m = 2e5;
  stiff.hand_damping_N_s_per_m = 600;
  Hand hand(stiff);
  hand.move_to({0.06, 0, -0.03}, 1s);
  hand.advance(Vector3d::Zero(), 500ms);
  EXPECT_TRUE(measured(hand).p_HD_m.isApprox(Vector3d(0.03, 0, -0.015), 0.02));
  // At half time 15/8 of the mean speed.
  EXPECT_NEAR(measured(hand).v_HD_H_m_per_s.x(), 1.875 * 0.06, 1e-3);
  hand.advance(Vector3d::Zero(), 250ms);
  // t = 3/4: 10 t^3 - 15 t^4 + 6 t^5 = 0.896484375
  EXPECT_NEAR(measured(hand).p_HD_m.x(), 0.06 * 0.896484375, 5e-4);
  hand.advance(Vector3d::Zero(), 1s);
  EXPECT_TRUE(measured(hand).p_HD_m.isApprox(Vector3d(0.06, 0, -0.03), 1e-6));
}

TEST(Hand, ReachingAgainStartsFromWhereItMeansToBe) {
  Hand hand(kHand);
  hand.move_to({0.1, 0, 0}, 400ms);
  hand.advance(Vector3d::Zero(), 200ms);
  hand.move_to({0.1, 0, 0}, 400ms);  // the same place: the other half of the way
  double largest = 0;
  for (int i = 0; i < 400; ++i) {
    hand.advance(Vector3d::Zero(), 1ms);
    largest = std::max(largest, measured(hand).v_HD_H_m_per_s.x());
  }
  EXPECT_LT(largest, 0.6);  // a jump of the remaining 5 cm would be a spring of 15 N on 0.8 kg
  hand.advance(Vector3d::Zero(), 4s);
  EXPECT_NEAR(measured(hand).p_HD_m.x(), 0.1, 1e-9);
}

TEST(Hand, APushAddsToWhatTheHandDoes) {
  Hand hand(kHand);
  hand.push({0, 0, 6});
  hand.advance(Vector3d::Zero(), 4s);
  EXPECT_NEAR(measured(hand).p_HD_m.z(), 0.02, 1e-9);
  hand.push(Vector3d::Zero());
  hand.advance(Vector3d::Zero(), 4s);
  EXPECT_NEAR(measured(hand).p_HD_m.z(), 0.0, 1e-9);
}

TEST(Hand, SwingsWithThePeriodAndDecayOfItsMassSpringAndDamper) {
  // Released 0.1 m from where it means to be. m 0.8 kg, k 300 N/m, c 12.5 N·s/m with the device's drag.
  const double m = 0.8, k = 300, c = 12.5;
  const double a = c / (2 * m), wd = std::sqrt(k / m - a * a);
  Hand hand(kHand);
  hand.hold_at({0.1, 0, 0});
  for (int i = 1; i <= 1000; ++i) {
    hand.advance(Vector3d::Zero(), 1ms);
    const double t = 1e-3 * i;
    const double expected_m = 0.1 * (1 - std::exp(-a * t) * (std::cos(wd * t) + a / wd * std::sin(wd * t)));
    // Semi-implicit Euler with steps of 1e-4 s: ω·h/2 = 1e-3 of the amplitude, more than needed.
    ASSERT_NEAR(measured(hand).p_HD_m[0], expected_m, 0.1 * 2e-3) << t;
  }
}

TEST(Hand, LetGoOnlyTheDevicesMassIsLeft) {
  HandParameters frictionless = kHand;
  frictionless.device_drag_N_s_per_m = 0;
  Hand hand(frictionless);
  hand.let_go();
  hand.advance({0, 0.6, 0}, 500ms);  // 2 m/s²
  EXPECT_NEAR(measured(hand).v_HD_H_m_per_s[1], 1.0, 1e-9);
  EXPECT_NEAR(measured(hand).p_HD_m[1], 0.25, 0.25 * 2.1e-4);  // Euler: one step of 1e-4 s in 0.5 s
}

TEST(Hand, LetGoTheDevicesDragStopsItAfterMassTimesSpeedOverDrag) {
  Hand hand(kHand);
  hand.let_go();
  hand.advance({0.3, 0, 0}, 100ms);
  const double v = measured(hand).v_HD_H_m_per_s[0];
  const double p = measured(hand).p_HD_m[0];
  hand.advance(Vector3d::Zero(), 12s);  // 20 time constants of 0.6 s
  EXPECT_NEAR(measured(hand).p_HD_m[0] - p, v * 0.3 / 0.5, 2e-4 * v);
  EXPECT_NEAR(measured(hand).v_HD_H_m_per_s[0], 0.0, 1e-8);
}

TEST(Hand, HoldingAgainTakesTheSpringBack) {
  Hand hand(kHand);
  hand.let_go();
  hand.advance({1, 0, 0}, 100ms);
  EXPECT_GT(measured(hand).p_HD_m[0], 0.01);
  hand.hold_at(Vector3d::Zero());
  hand.advance(Vector3d::Zero(), 4s);
  EXPECT_NEAR(measured(hand).p_HD_m[0], 0.0, 1e-9);
}

TEST(Hand, WithoutForceItLosesEnergyInEveryMillisecond) {
  Hand hand(kHand);
  hand.advance({10, -5, 3}, 80ms);
  const auto energy_J = [&hand] {
    const hal::HapticSample sample = measured(hand);
    return 0.5 * 0.8 * sample.v_HD_H_m_per_s.squaredNorm() + 0.5 * 300 * sample.p_HD_m.squaredNorm();
  };
  double last_J = energy_J();
  for (int i = 0; i < 500; ++i) {
    hand.advance(Vector3d::Zero(), 1ms);
    // Semi-implicit Euler keeps a neighbouring energy: it breathes by ω·h = 2e-3 of it within a swing.
    ASSERT_LE(energy_J(), last_J * (1 + 1e-4)) << i;
    last_J = energy_J();
  }
  EXPECT_LT(last_J, 1e-3 * 0.3);
}

TEST(Hand, TimeMayComeInAnyPortions) {
  Hand once(kHand), often(kHand);
  once.advance({2, 1, 0}, 300ms);
  for (int i = 0; i < 3000; ++i) often.advance({2, 1, 0}, 100us);
  EXPECT_TRUE(measured(once).p_HD_m.isApprox(measured(often).p_HD_m, 1e-9));
  once.advance({2, 1, 0}, 0ns);
  EXPECT_TRUE(measured(once).p_HD_m.allFinite());
}

TEST(Hand, DoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  Hand hand(kHand);
  hal::HapticSample sample;
  const support::NoAllocGuard guard;
  hand.advance({1, 2, 3}, 10ms);
  hand.measure(sample);
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_GT(sample.p_HD_m.norm(), 0.0);
}

}  // namespace
