// Time-domain passivity of a link with delay: energies at its two ports, with random hands, robots and
// networks.
#include "control/delayed_port.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include "tests/support/no_alloc_guard.h"

namespace delayed_port_test {

using control::DelayedPortConfig;
using control::HandPort;
using control::PortLedger;
using control::RobotPort;
using Eigen::Vector3d;

constexpr double kPeriod_s = 1e-3;
constexpr double kReserve_J = 0.02;

TEST(PortLedger, WhatEntersAtOnePortMayLeaveAtTheOther) {
  PortLedger ledger(kReserve_J, 0.1);
  EXPECT_DOUBLE_EQ(ledger.level_J(0), kReserve_J);
  EXPECT_DOUBLE_EQ(ledger.level_J(0.05), kReserve_J + 0.05);
  ledger.count(0.03);   // leaves
  ledger.count(-0.01);  // enters: for the other port, not for this one
  EXPECT_DOUBLE_EQ(ledger.out_J(), 0.03);
  EXPECT_DOUBLE_EQ(ledger.in_J(), 0.01);
  EXPECT_DOUBLE_EQ(ledger.level_J(0.05), kReserve_J + 0.02);
}

TEST(PortLedger, ASurplusIsForgottenForGood) {
  PortLedger ledger(kReserve_J, 0.1);
  EXPECT_DOUBLE_EQ(ledger.level_J(5), kReserve_J + 0.1);
  ledger.count(0.1);
  EXPECT_NEAR(ledger.level_J(5), kReserve_J, 1e-12);
  EXPECT_NEAR(ledger.level_J(5.05), kReserve_J + 0.05, 1e-12);
}

TEST(RobotPort, FollowsAnUnloadedHandleAtOnceAndALimitedWayPerCycle) {
  RobotPort port({});
  EXPECT_EQ(port.step({1, 2, 3}, Vector3d::Zero(), 0, 0.001), Vector3d(1, 2, 3)) << "where it begins";
  EXPECT_EQ(port.step({1.0005, 2, 3}, Vector3d::Zero(), 0, 0.001), Vector3d(1.0005, 2, 3));
  EXPECT_NEAR(port.step({1.5, 2, 3}, Vector3d::Zero(), 0, 0.001).x(), 1.0015, 1e-12);
}

TEST(RobotPort, MotionAgainstTheForceWaitsForItsEnergyAndThenCatchesUp) {
  RobotPort port({});
  (void)port.step(Vector3d::Zero(), Vector3d::Zero(), 0, 1);
  const Vector3d force_N(-4, 0, 0);  // on the hand: against +x
  // The reserve is 20 mJ: 5 mm against 4 N, and any way across it.
  Vector3d p_m = port.step({0.02, 0.03, 0}, force_N, 0, 1);
  EXPECT_NEAR(p_m.x(), 0.005, 1e-12);
  EXPECT_NEAR(p_m.y(), 0.03, 1e-12);
  // The hand's work arrives: 40 mJ are 10 mm more.
  p_m = port.step({0.02, 0.03, 0}, force_N, 0.04, 1);
  EXPECT_NEAR(p_m.x(), 0.015, 1e-12);
  // Without force the rest of the way costs nothing: no offset remains.
  p_m = port.step({0.02, 0.03, 0}, Vector3d::Zero(), 0.04, 1);
  EXPECT_NEAR(p_m.x(), 0.02, 1e-12);
  EXPECT_NEAR(port.ledger().out_J(), 0.06, 1e-12);
}

TEST(RobotPort, MotionWithTheForceIsFreeAndCounted) {
  RobotPort port({});
  (void)port.step(Vector3d::Zero(), Vector3d::Zero(), 0, 1);
  EXPECT_NEAR(port.step({-0.05, 0, 0}, {-4, 0, 0}, 0, 1).x(), -0.05, 1e-12);
  EXPECT_NEAR(port.ledger().in_J(), 0.2, 1e-12);
}

TEST(HandPort, AForceThatTheHandMovesAgainstPasses) {
  HandPort port({});
  const Vector3d force_N(-4, 0, 0);
  Vector3d p_m = Vector3d::Zero();
  Vector3d held_N = Vector3d::Zero();
  for (int i = 0; i < 500; ++i) {
    held_N = port.step(p_m, {0.1, 0, 0}, held_N, force_N, 0);
    EXPECT_NEAR((held_N - force_N).norm(), 0, 1e-12) << i;
    p_m.x() += 0.1 * kPeriod_s;
  }
  EXPECT_NEAR(port.ledger().in_J(), 4 * 0.1 * 0.499, 1e-3);
}

TEST(HandPort, AForceThatMovesTheHandEndsWithTheEnergyThatArrived) {
  HandPort port({});
  const Vector3d force_N(4, 0, 0);
  Vector3d p_m = Vector3d::Zero();
  Vector3d held_N = Vector3d::Zero();
  for (int i = 0; i < 2000; ++i) {
    held_N = port.step(p_m, {0.1, 0, 0}, held_N, force_N, 0.05);
    p_m.x() += 0.1 * kPeriod_s;
  }
  EXPECT_LE(port.ledger().out_J(), kReserve_J + 0.05);
  EXPECT_LT(held_N.x(), 0.01);
}

/// A hand of random pushes and a robot of random springs with a network of random delays between them, both
/// with the same wild forces: most of them not passive.
struct Wild {
  explicit Wild(unsigned seed, int delay, int jitter, bool active) : random(seed) {
    DelayedPortConfig config;
    config.active = active;
    config.tank.force_rate_N_per_s = 1e9;  // this device follows at once
    HandPort hand(config);
    RobotPort robot(config);
    std::uniform_int_distribution<int> shift(-jitter, jitter);
    std::vector<std::pair<Vector3d, double>> to_robot(kCycles + 400, {Vector3d::Zero(), 0});
    std::vector<std::pair<Vector3d, double>> to_hand = to_robot;
    Vector3d p_m = Vector3d::Zero();
    Vector3d v_m_per_s = Vector3d::Zero();
    Vector3d held_N = Vector3d::Zero();
    Vector3d robot_N = Vector3d::Zero();
    std::pair<Vector3d, double> at_robot{Vector3d::Zero(), 0};
    std::pair<Vector3d, double> at_hand{Vector3d::Zero(), 0};
    for (std::size_t i = 0; i < kCycles; ++i) {
      v_m_per_s += 0.02 * draw() - 0.01 * v_m_per_s;
      p_m += v_m_per_s * kPeriod_s;
      // The energy only grows: a late message brings nothing back.
      if (to_robot[i].second >= at_robot.second && to_robot[i].second > 0) at_robot = to_robot[i];
      if (to_hand[i].second >= at_hand.second && to_hand[i].second > 0) at_hand = to_hand[i];
      held_N = hand.step(p_m, v_m_per_s, held_N, at_hand.first, at_hand.second);
      const Vector3d robot_m = robot.step(at_robot.first, robot_N, at_robot.second, 0.001);
      robot_N = -70 * robot_m + 3 * draw();
      const auto later = [&] { return i + static_cast<std::size_t>(std::max(0, delay + shift(random))) + 1; };
      if (random() % 20 != 0)
        to_robot[std::min(later(), to_robot.size() - 1)] = {p_m, hand.ledger().in_J() + 1e-12};
      if (random() % 20 != 0)
        to_hand[std::min(later(), to_hand.size() - 1)] = {robot_N, robot.ledger().in_J() + 1e-12};
      const double sum_J =
          hand.ledger().in_J() - hand.ledger().out_J() + robot.ledger().in_J() - robot.ledger().out_J();
      least_J = std::min(least_J, sum_J);
    }
  }
  Vector3d draw() {
    std::normal_distribution<double> normal;
    return {normal(random), normal(random), normal(random)};
  }
  static constexpr std::size_t kCycles = 20'000;
  std::mt19937 random;
  double least_J = 0;
};

// One cycle's force may deliver what it does before the next sample shows it.
constexpr double kCycle_J = 0.01;

TEST(DelayedPorts, TogetherNeverGiveMoreThanTwoReserves) {
  for (unsigned seed = 1; seed <= 4; ++seed)
    for (const int delay : {0, 25, 60, 150})
      for (const int jitter : {0, 50})
        EXPECT_GT(Wild(seed, delay, std::min(jitter, delay), true).least_J, -2 * kReserve_J - kCycle_J)
            << "seed " << seed << ", " << delay << " ± " << jitter << " ms";
}

TEST(DelayedPorts, WithoutControlTheSameLinkGivesEnergyWithoutEnd) {
  EXPECT_LT(Wild(1, 150, 50, false).least_J, -20 * kReserve_J);
}

/// A spring at the robot, a hand that presses it and lets it go, slowly; without delay, but for the one cycle
/// of each loop.
TEST(DelayedPorts, AreTransparentWithoutDelay) {
  HandPort hand({});
  RobotPort robot({});
  Vector3d held_N = Vector3d::Zero();
  Vector3d robot_N = Vector3d::Zero();
  double last_m = 0;
  for (int i = 0; i < 8000; ++i) {
    const double x_m = 0.04 * (1 - std::cos(2 * std::numbers::pi * i * kPeriod_s / 2));
    const Vector3d v_m_per_s((x_m - last_m) / kPeriod_s, 0, 0);
    last_m = x_m;
    const Vector3d received_m = robot.step({x_m, 0, 0}, robot_N, hand.ledger().in_J(), 0.001);
    EXPECT_NEAR(received_m.x(), x_m, 1e-12) << i;
    const Vector3d spring_N(-70 * std::max(0.0, received_m.x() - 0.02), 0, 0);
    held_N = hand.step({x_m, 0, 0}, v_m_per_s, held_N, robot_N, robot.ledger().in_J());
    EXPECT_NEAR((held_N - robot_N).norm(), 0, 1e-12) << i;
    robot_N = spring_N;
  }
}

TEST(DelayedPorts, WithoutControlNothingChanges) {
  DelayedPortConfig config;
  config.active = false;
  HandPort hand(config);
  RobotPort robot(config);
  (void)robot.step(Vector3d::Zero(), Vector3d::Zero(), 0, 1);
  EXPECT_EQ(robot.step({0.1, 0, 0}, {-100, 0, 0}, 0, 1), Vector3d(0.1, 0, 0));
  EXPECT_EQ(hand.step(Vector3d::Zero(), {1, 0, 0}, Vector3d::Zero(), {8, 0, 0}, 0), Vector3d(8, 0, 0));
}

TEST(DelayedPorts, RefuseImpossibleValues) {
  EXPECT_THROW(HandPort({.surplus_J = -1}), std::invalid_argument);
  EXPECT_THROW(RobotPort({.tank = {.reserve_J = 0}}), std::invalid_argument);
}

TEST(DelayedPorts, NeitherAllocateNorLock) {
  HandPort hand({});
  RobotPort robot({});
  long violations = 0;
  {
    const support::NoAllocGuard guard;
    for (int i = 0; i < 100; ++i) {
      (void)hand.step({1e-3 * i, 0, 0}, {1, 0, 0}, {1, 0, 0}, {4, 0, 0}, 0.01);
      (void)robot.step({1e-3 * i, 0, 0}, {-4, 0, 0}, 0.01, 0.001);
    }
    violations = guard.violations();
  }
  EXPECT_EQ(violations, 0);
}

}  // namespace delayed_port_test
