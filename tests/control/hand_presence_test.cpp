// Held and free handles under forces: whether and how soon they are distinguished.
#include "control/hand_presence.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include "sim/hand.h"
#include "tests/support/no_alloc_guard.h"

namespace hand_presence_test {

using control::HandPresence;
using Eigen::Vector3d;
using namespace std::chrono_literals;

constexpr double kPeriod_s = 1e-3;
constexpr double kNothingWithheld_N = 0;
const HandPresence::Config kConfig{.period_s = kPeriod_s,
                                   .device_mass_kg = 0.3,
                                   .device_drag_N_s_per_m = 0.5,
                                   .bandwidth_rad_per_s = 60,
                                   .telling_force_N = 0.3,
                                   .released_share = 0.3,
                                   .released_impulse_N_s = 0.1,
                                   .felt_hand_N = 0.1,
                                   .unfelt_after_s = 0.3};

/// One cycle of a held or free handle under a device's force; true while a hand is detected.
bool step(HandPresence& presence, sim::Hand& hand, const Vector3d& force_N) {
  hand.advance(force_N, 1ms);
  return presence.step(hand.v_HD_H_m_per_s(), force_N, kNothingWithheld_N);
}

/// Time until release is detected, for a handle that is released and pushed; a second if never.
double found_after_s(double mass_kg, double force_N) {
  sim::Hand hand({.device_mass_kg = mass_kg});
  hand.let_go();
  HandPresence presence(kConfig);
  int n = 0;
  while (n < 1000 && step(presence, hand, force_N * Vector3d(0.6, 0, -0.8))) ++n;
  return n * kPeriod_s;
}

TEST(HandPresence, FindsThatAGripFliesOnItsOwnOnceTheImpulseIsThere) {
  // The filter gets the force and its response at the same time: the device's share rises past 0.3 N within
  // ln(f/(f − 0.3))/ω, and the impulse of 0.1 N·s follows.
  for (const double force_N : {0.5, 1.0, 2.0, 8.0}) {
    const double telling_s = std::log(force_N / (force_N - 0.3)) / 60;
    EXPECT_LE(found_after_s(0.3, force_N), 0.1 / force_N + telling_s + 1 / 60.0 + 0.002) << force_N;
    EXPECT_GE(found_after_s(0.3, force_N), 0.1 / force_N - 0.002) << force_N << ": no less impulse is enough";
  }
}

TEST(HandPresence, FindsItWithAMassThatIsThirtyPerCentWrong) {
  // A lighter handle seems to have a helping hand, until its drag takes a share of the force.
  for (const double mass_kg : {0.21, 0.39})
    for (const double force_N : {1.0, 2.0, 8.0})
      EXPECT_LT(found_after_s(mass_kg, force_N), 0.4) << mass_kg << " kg, " << force_N << " N";
}

TEST(HandPresence, WithoutAForceNothingIsDecided) {
  sim::Hand hand({});
  hand.let_go();
  hand.push({0.5, 0, 0});
  HandPresence presence(kConfig);
  for (int n = 0; n < 5000; ++n) ASSERT_TRUE(step(presence, hand, Vector3d::Zero())) << n;
  EXPECT_EQ(found_after_s(0.3, 0.25), 1.0) << "nor with one that can hardly be distinguished from none";
}

struct Holding {
  const char* how;
  double mass_kg;
  double stiffness_N_per_m;
  double damping_N_s_per_m;
};

TEST(HandPresence, NeverTakesAHandForNoneHoweverItHoldsAndMoves) {
  std::mt19937 random(23);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto vector = [&](double size) {
    return Vector3d(Vector3d::NullaryExpr([&] { return size * any(random); }));
  };
  for (const Holding& holding : {Holding{"at ease", 0.5, 300, 12}, Holding{"firmly", 0.8, 1000, 40},
                                 Holding{"loosely", 0.4, 60, 8}, Holding{"giving way", 0.5, 0, 8}})
    for (int run = 0; run < 40; ++run) {
      sim::Hand hand({.hand_mass_kg = holding.mass_kg,
                      .hand_stiffness_N_per_m = holding.stiffness_N_per_m,
                      .hand_damping_N_s_per_m = holding.damping_N_s_per_m});
      HandPresence presence(kConfig);
      Vector3d aim_N = Vector3d::Zero(), force_N = Vector3d::Zero();
      for (int n = 0; n < 5000; ++n) {
        if (n % 400 == 0)
          hand.move_to(vector(0.08),
                       std::chrono::milliseconds(300 + 100 * static_cast<int>(4 * (1 + any(random)))));
        if (n % 300 == 0) aim_N = vector(n % 600 == 0 ? 5 : 1);
        const Vector3d change_N = aim_N - force_N;
        force_N += std::min(1.0, 0.2 / std::max(change_N.norm(), 1e-12)) * change_N;  // 200 N/s
        ASSERT_TRUE(step(presence, hand, force_N)) << holding.how << ", run " << run << ", " << n << " ms";
      }
    }
}

TEST(HandPresence, AHandThatGivesWayNowAndThenIsNotAddedUp) {
  // For 60 ms with 1 N nothing holds against it, and then a hand does for as long; a hundred times.
  sim::Hand grip({});
  grip.let_go();
  HandPresence presence(kConfig);
  for (int n = 0; n < 12'000; ++n) {
    grip.push(n % 120 < 60 ? Vector3d::Zero() : Vector3d(-1.9, 0, 0));
    ASSERT_TRUE(step(presence, grip, Vector3d::UnitX())) << n << " ms";
  }
}

TEST(HandPresence, ReportsTheForceOfTheHand) {
  sim::Hand hand({});
  HandPresence presence(kConfig);
  const Vector3d force_N(1, -2, 0.5);
  for (int n = 0; n < 3000; ++n) step(presence, hand, force_N);
  EXPECT_LT((presence.hand_force_N() + force_N).norm(), 1e-3) << "what holds against the device";
  hand.let_go();
  for (int n = 0; n < 200; ++n) step(presence, hand, force_N);
  EXPECT_LT(presence.hand_force_N().norm(), 0.02);
}

TEST(HandPresence, WhatAGripTakesUpInAGapInTimeIsNoForceOfTheHand) {
  for (const bool bridged : {true, false}) {
    sim::Hand hand({.device_mass_kg = 0.3});
    HandPresence presence(kConfig);
    const Vector3d force_N(2, 0, 0);
    for (int n = 0; n < 500; ++n) step(presence, hand, force_N);
    const Vector3d before_N = presence.hand_force_N();
    ASSERT_NEAR(before_N.x(), -2, 0.1);
    hand.move_to({0.05, 0, 0}, 100ms);
    hand.advance(force_N, 60ms);
    const Vector3d v_m_per_s = hand.v_HD_H_m_per_s();
    ASSERT_GT(v_m_per_s.x(), 0.1);
    if (bridged)
      presence.bridge(v_m_per_s);
    else
      presence.step(v_m_per_s, force_N, kNothingWithheld_N);
    const double changed_N = (presence.hand_force_N() - before_N).norm();
    if (bridged) {
      EXPECT_LT(changed_N, 1e-12);
    } else {
      EXPECT_GT(changed_N, 1.0) << "else there is nothing to bridge";
    }
  }
}

TEST(HandPresence, AHandThatIsNotThereIsNotFoundAgain) {
  sim::Hand hand({});
  hand.let_go();
  HandPresence presence(kConfig);
  for (int n = 0; n < 300; ++n) step(presence, hand, {2, 0, 0});
  hand.take_hold();
  for (int n = 0; n < 300; ++n) ASSERT_FALSE(step(presence, hand, {2, 0, 0}));
  presence.reset();
  EXPECT_TRUE(step(presence, hand, Vector3d::Zero())) << "that is said by a button";
}

TEST(HandPresence, AGripThatNothingIsFeltOfHasNoHandWhileAForceIsWithheld) {
  HandPresence presence(kConfig);
  int n = 0;
  while (n < 1000 && presence.step(Vector3d::Zero(), Vector3d::Zero(), 2)) ++n;
  EXPECT_NEAR(n * kPeriod_s, 0.3, 0.002);

  HandPresence held(kConfig);
  for (int k = 0; k < 1000; ++k) ASSERT_TRUE(held.step(Vector3d::Zero(), {0, 0.2, 0}, 2)) << k;
  HandPresence nothing_withheld(kConfig);
  for (int k = 0; k < 1000; ++k)
    ASSERT_TRUE(nothing_withheld.step(Vector3d::Zero(), Vector3d::Zero(), 0.2)) << k;
}

TEST(HandPresence, RefusesWhatIsNotPositiveByName) {
  using Config = HandPresence::Config;
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    for (const auto& [name, member] :
         {std::pair{"period_s", &Config::period_s}, std::pair{"device_mass_kg", &Config::device_mass_kg},
          std::pair{"bandwidth_rad_per_s", &Config::bandwidth_rad_per_s},
          std::pair{"telling_force_N", &Config::telling_force_N},
          std::pair{"released_share", &Config::released_share},
          std::pair{"released_impulse_N_s", &Config::released_impulse_N_s},
          std::pair{"felt_hand_N", &Config::felt_hand_N},
          std::pair{"unfelt_after_s", &Config::unfelt_after_s}}) {
      Config config = kConfig;
      config.*member = bad;
      try {
        const HandPresence presence(config);
        FAIL() << name << " = " << bad;
      } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
      }
    }
  Config config = kConfig;
  config.device_drag_N_s_per_m = -0.1;
  EXPECT_THROW(HandPresence{config}, std::invalid_argument);
}

TEST(HandPresence, StepDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  HandPresence presence(kConfig);
  const support::NoAllocGuard guard;
  presence.reset();
  for (int n = 0; n < 10; ++n) presence.step({0.1, 0, 0}, {1, 0, 0}, 1);
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace hand_presence_test
