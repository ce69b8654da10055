// The hand on the haptic device: a mass, a spring and a damper, compared with closed forms.
#include "sim/hand.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "tests/support/no_alloc_guard.h"

namespace hand_test {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using sim::Hand;
using sim::HandParameters;

const HandParameters kHand{.device_mass_kg = 0.3,
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

TEST(Hand, TurnsThePenByTheShorterArcWithLeastJerk) {
  Hand hand(kHand);
  const Eigen::Quaterniond quarter(Eigen::AngleAxisd(0.5 * std::numbers::pi, Vector3d::UnitZ()));
  Eigen::Quaterniond same = quarter;
  same.coeffs() *= -1;  // the same orientation by the longer arc
  hand.turn_to(same, 1s);
  hand.advance(Vector3d::Zero(), 250ms);
  // t = 1/4: 1 - 0.896484375 of the quarter turn.
  const Eigen::AngleAxisd begun(0.103515625 * 0.5 * std::numbers::pi, Vector3d::UnitZ());
  EXPECT_LT(measured(hand).q_HD.angularDistance(Eigen::Quaterniond(begun)), 1e-7);
  hand.advance(Vector3d::Zero(), 1s);
  EXPECT_LT(measured(hand).q_HD.angularDistance(quarter), 1e-7);
}

TEST(Hand, AReleasedPenKeepsItsDirectionUntilItIsFlipped) {
  Hand hand(kHand);
  const Eigen::Quaterniond over(Eigen::AngleAxisd(3.0, Vector3d::UnitX()));
  hand.flip(over, 100ms);  // in the hand: nothing
  hand.advance(Vector3d::Zero(), 200ms);
  EXPECT_EQ(measured(hand).q_HD.angularDistance(Eigen::Quaterniond::Identity()), 0.0);
  hand.turn_to(over, 1s);
  hand.advance(Vector3d::Zero(), 500ms);
  hand.let_go();
  hand.advance(Vector3d::Zero(), 1s);
  EXPECT_NEAR(measured(hand).q_HD.angularDistance(Eigen::Quaterniond::Identity()), 1.5, 1e-6);
  hand.flip(over, 100ms);
  hand.advance(Vector3d::Zero(), 100ms);
  EXPECT_FALSE(hand.holds());
  EXPECT_LT(measured(hand).q_HD.angularDistance(over), 1e-6);
  hand.flip(Eigen::Quaterniond::Identity(), 1s);
  hand.advance(Vector3d::Zero(), 500ms);
  hand.take_hold();  // catches it in the middle
  hand.advance(Vector3d::Zero(), 1s);
  EXPECT_NEAR(measured(hand).q_HD.angularDistance(over), 1.5, 1e-6);
}

TEST(Hand, TakesHoldOfThePenWhereItIs) {
  Hand hand(kHand);
  hand.let_go();
  hand.advance({1, 0, 0}, 200ms);
  const Vector3d p_m = hand.p_HD_m();
  ASSERT_GT(p_m.x(), 0.05);
  hand.take_hold();
  EXPECT_EQ(hand.intended_p_HD_m(), p_m);
  hand.advance(Vector3d::Zero(), 4s);
  EXPECT_TRUE(hand.p_HD_m().isApprox(p_m, 1e-9));
  // A holding hand keeps its intended position.
  hand.advance({0, 3, 0}, 4s);
  hand.take_hold();
  hand.advance(Vector3d::Zero(), 4s);
  EXPECT_TRUE(hand.p_HD_m().isApprox(p_m, 1e-9));
}

TEST(Hand, ButtonsArePressedAndReleasedOneByOne) {
  Hand hand(kHand);
  hand.press(0b101);
  hand.release(0b001);
  hand.press(0b010);
  EXPECT_EQ(measured(hand).buttons, 0b110U);
}

TEST(Hand, TheForceBetweenHandAndGripIsWhatTheDeviceNeedsToMoveAsItDoes) {
  Hand hand(kHand);
  hand.push({0, 2, 0});
  hand.move_to({0.08, 0, 0}, 600ms);
  for (int i = 0; i < 900; ++i) {
    const Vector3d before = hand.v_HD_H_m_per_s();
    const Vector3d device_N(0, 0, 3.0 * std::sin(0.02 * i));
    hand.advance(device_N, 100us);
    const Vector3d a_m_per_s2 = (hand.v_HD_H_m_per_s() - before) / 1e-4;
    // Newton for the free handle.
    ASSERT_TRUE(hand.grip_force_N().isApprox(0.3 * a_m_per_s2 - device_N + 0.5 * before, 1e-9)) << i;
    EXPECT_EQ(hand.device_force_N(), device_N);
  }
  const Vector3d p_m = hand.p_HD_m();
  const Vector3d v_m_per_s = hand.v_HD_H_m_per_s();
  hand.advance({0, 0, -6}, 5ms);  // mean over all of it: momentum gained, drag for the way gone
  const Vector3d gained_Ns = 0.3 * (hand.v_HD_H_m_per_s() - v_m_per_s) + 0.5 * (hand.p_HD_m() - p_m);
  EXPECT_TRUE(hand.grip_force_N().isApprox(gained_Ns / 5e-3 + Vector3d(0, 0, 6), 1e-3));
  hand.advance({0, 0, -6}, 0ns);
  EXPECT_GT(hand.grip_force_N().norm(), 1.0);
  hand.let_go();
  hand.advance({0, 0, -6}, 1ms);
  EXPECT_TRUE(hand.grip_force_N().isApprox(Vector3d(0, 2, 0)));  // of the push alone
}

TEST(Hand, AGripThatIsLetGoStaysWithinItsTravel) {
  HandParameters bounded = kHand;
  bounded.travel.emplace();
  for (const Vector3d& direction :
       {Vector3d(1, 0, 0), Vector3d(-1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, -1, 0), Vector3d(0, 0, 1),
        Vector3d(0, 0, -1), Vector3d(0.6, 0.6, -0.5), Vector3d(-0.5, 0.5, 0.7)}) {
    Hand hand(bounded);
    hand.let_go();
    for (int i = 0; i < 2000; ++i) {
      hand.advance(12 * direction, 1ms);  // the omega's whole force
      const Vector3d& p = hand.p_HD_m();
      // Thrown on at 2 m/s at most; then as deep as energy goes: v·√(m/k), about 9 mm.
      const double spheroid =
          (p - bounded.travel->centre_H_m).cwiseQuotient(bounded.travel->semi_axes_m).norm();
      ASSERT_LT(spheroid, 1.1) << p.transpose();
      ASSERT_GT(p.x(), bounded.travel->lowest_x_m - 0.01);
      ASSERT_GT(p.z(), bounded.travel->lowest_z_m - 0.01);
    }
    EXPECT_LT(hand.v_HD_H_m_per_s().dot(direction), 0.05);
    EXPECT_GT(hand.p_HD_m().dot(direction), 0.05);  // it does go that far
  }
}

TEST(Hand, AnEndStopPushesTheGripBackWithForceOverStiffnessAndNeverPulls) {
  HandParameters bounded = kHand;
  bounded.travel.emplace();
  bounded.device_drag_N_s_per_m = 0;
  Hand hand(bounded);
  hand.let_go();
  hand.advance({0, 0, -12}, 5s);
  EXPECT_NEAR(hand.p_HD_m().z(), -0.086 - 12.0 / 14'500, 1e-6);
  double last_m_per_s = 0;
  for (int i = 0; i < 1000; ++i) {
    hand.advance(Vector3d::Zero(), 100us);
    ASSERT_GE(hand.v_HD_H_m_per_s().z(), last_m_per_s);  // on the way back nothing holds it
    last_m_per_s = hand.v_HD_H_m_per_s().z();
  }
  EXPECT_GT(hand.p_HD_m().z(), -0.086);
  // The stop's damping dissipated a part of its stored energy.
  const double stored_J = 0.5 * 12.0 * 12.0 / 14'500;
  EXPECT_LT(0.5 * 0.3 * last_m_per_s * last_m_per_s, 0.8 * stored_J);
  EXPECT_GT(0.5 * 0.3 * last_m_per_s * last_m_per_s, 0.1 * stored_J);
}

TEST(Hand, RefusesParametersThatMakeNoHand) {
  for (const double bad : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    HandParameters parameters = kHand;
    parameters.device_mass_kg = bad;
    EXPECT_THROW(Hand{parameters}, std::invalid_argument);
    parameters = kHand;
    parameters.hand_stiffness_N_per_m = bad;
    EXPECT_THROW(Hand{parameters}, std::invalid_argument);
    parameters = kHand;
    parameters.travel.emplace().semi_axes_m.y() = bad;
    EXPECT_THROW(Hand{parameters}, std::invalid_argument);
  }
  HandParameters nowhere = kHand;
  nowhere.travel.emplace().lowest_z_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Hand{nowhere}, std::invalid_argument);
}

TEST(Hand, DoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  Hand hand(kHand);
  hal::HapticSample sample;
  const support::NoAllocGuard guard;
  hand.turn_to(Eigen::Quaterniond(0, 1, 0, 0), 5ms);
  hand.advance({1, 2, 3}, 10ms);
  hand.measure(sample);
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_GT(sample.p_HD_m.norm(), 0.0);
}

}  // namespace hand_test
