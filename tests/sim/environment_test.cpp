// Contacts of the simulated end effector: contact laws, and that no contact generates energy.
#include "sim/environment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include "tests/support/no_alloc_guard.h"

namespace environment_test {

using Eigen::Vector3d;
using sim::Environment;
using sim::EnvironmentParameters;

constexpr double kGravity_m_per_s2 = 9.81;
constexpr double kStep_s = 5e-5;
constexpr double kRadius_m = 0.01;
const Vector3d kFarAway(0, 0, 10);

/// A ball of `mass_kg` instead of a robot: it goes where it is pushed.
struct Ball {
  double mass_kg = 0.5;
  Vector3d p_m = Vector3d::Zero();
  Vector3d v_m_per_s = Vector3d::Zero();
  Vector3d force_N = Vector3d::Zero();  // of the environment, at the last step

  void step(Environment& environment, const Vector3d& push_N = Vector3d::Zero(), double step_s = kStep_s) {
    force_N = environment.step(p_m, v_m_per_s, step_s);
    v_m_per_s += step_s / mass_kg * (force_N + push_N);
    p_m += step_s * v_m_per_s;
  }
  double kinetic_energy_J() const { return 0.5 * mass_kg * v_m_per_s.squaredNorm(); }
};

/// A wall at x = 0 that fills x > 0, far from the floor.
EnvironmentParameters with_wall(const sim::Surface& surface) {
  EnvironmentParameters parameters;
  parameters.walls = {{.normal_W = -Vector3d::UnitX(), .surface = surface}};
  return parameters;
}
Ball before_wall() {
  Ball ball;
  ball.p_m = {-0.02, 0, 1};
  return ball;
}

EnvironmentParameters with_box(const Vector3d& centre_m) {
  EnvironmentParameters parameters;
  parameters.box = {{.block = {.centre_W_m = centre_m, .size_m = {0.1, 0.08, 0.06}}}};
  return parameters;
}
void let_pass(Environment& environment, double duration_s) {
  for (double t = 0; t < duration_s; t += kStep_s) environment.step(kFarAway, Vector3d::Zero(), kStep_s);
}

TEST(Environment, NothingIsFeltWhereNothingIs) {
  Environment environment(with_wall({}));
  EXPECT_EQ(environment.step({-kRadius_m, 0, 1}, {1, 0, 0}, kStep_s), Vector3d::Zero());
  EXPECT_EQ(environment.step({-1, 0, kRadius_m}, {1, 0, 0}, kStep_s), Vector3d::Zero());
}

TEST(Environment, AWallPushesAsHardAsItIsPushedAndGivesWayByItsStiffness) {
  Environment environment(with_wall({.stiffness_N_per_m = 1e4}));
  Ball ball = before_wall();
  for (double t = 0; t < 5; t += kStep_s) ball.step(environment, {8, 0, 0});
  EXPECT_NEAR(ball.force_N.x(), -8, 1e-3);
  EXPECT_NEAR(ball.force_N.y(), 0, 1e-12);
  EXPECT_NEAR(ball.p_m.x(), -kRadius_m + 8 / 1e4, 1e-6);
}

TEST(Environment, ASurfaceBouncesAsHuntAndCrossleyFound) {
  // e = 1 − α·v to first order, whatever stiffness and mass. The next term is of the order of (α·v)²; and
  // where in a step the ball arrives and leaves is worth (ω·h)².
  for (const double stiffness_N_per_m : {5e3, 5e4})
    for (const double mass_kg : {0.2, 2.0})
      for (const double v_m_per_s : {0.05, 0.1, 0.2}) {
        Environment environment(
            with_wall({.stiffness_N_per_m = stiffness_N_per_m, .loss_s_per_m = 0.5, .friction = 0}));
        Ball ball = before_wall();
        ball.mass_kg = mass_kg;
        ball.v_m_per_s = {v_m_per_s, 0, 0};
        for (double t = 0; t < 1; t += kStep_s) ball.step(environment);
        const double loss = 0.5 * v_m_per_s;
        EXPECT_NEAR(-ball.v_m_per_s.x() / v_m_per_s, 1 - loss,
                    loss * loss + stiffness_N_per_m / mass_kg * kStep_s * kStep_s)
            << stiffness_N_per_m << " N/m, " << mass_kg << " kg, " << v_m_per_s << " m/s";
      }
}

TEST(Environment, NoBounceReturnsMoreThanItBrought) {
  // Wall, floor and table from all sides, slow and fast, soft and hard, never deeper than the ball's radius.
  // A bounce without loss may gain what a step cannot see: the ball is up to v·h deep when it is first felt,
  // which is worth ½·k·(v·h)².
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto any = [&] { return Vector3d(uniform(random), uniform(random), uniform(random)); };
  int hits = 0;
  for (int run = 0; run < 300; ++run) {
    const sim::Surface surface{.stiffness_N_per_m = run % 2 ? 2e4 : 1e5,
                               .loss_s_per_m = run % 3 ? 0.5 : 0.0,
                               .friction = run % 5 * 0.25};
    EnvironmentParameters parameters;
    parameters.floor = surface;
    parameters.walls = {{.p_W_m = {0.3, 0, 0}, .normal_W = {-1, 0.3, 0.2}, .surface = surface}};
    parameters.tables = {{.centre_W_m = {0, 0, 0.15}, .size_m = {0.3, 0.3, 0.3}, .surface = surface}};
    Environment environment(parameters);
    Ball ball;
    ball.p_m = Vector3d(0, 0, 0.5) + 0.12 * any();
    ball.v_m_per_s = (run % 7 ? 0.6 : 0.05) * (any() - Vector3d(0, 0, 0.8));
    const double brought_J = ball.kinetic_energy_J();
    const double unseen_J =
        0.5 * surface.stiffness_N_per_m * std::pow(ball.v_m_per_s.norm() * kStep_s, 2) + 1e-12;
    bool touched = false;
    double allowed_J = brought_J;
    for (double t = 0; t < 2 && ball.p_m.norm() < 1; t += kStep_s) {
      ball.step(environment);
      const bool touches = ball.force_N.norm() > 0;
      if (touched && !touches) {
        ++hits;
        allowed_J += unseen_J;
        ASSERT_LE(ball.kinetic_energy_J(), allowed_J) << "run " << run;
        allowed_J = std::min(allowed_J, ball.kinetic_energy_J());
      }
      touched = touches;
    }
  }
  EXPECT_GT(hits, 200);
}

TEST(Environment, AHitBoxAndTheBallShareTheirMomentumAndGainNoEnergy) {
  // In the air and for a short time, so that the fall is known.
  EnvironmentParameters parameters = with_box({0, 0, 5});
  parameters.box->block.surface = {.stiffness_N_per_m = 2e4, .loss_s_per_m = 0.5, .friction = 0.5};
  for (const double height_m : {0.0, 0.035}) {  // flat on its face, and at its upper edge
    Environment environment(parameters);
    Ball ball;
    ball.p_m = {-0.061, 0.01, 5 + height_m};
    ball.v_m_per_s = {0.5, 0.05, 0};
    const Vector3d brought = ball.mass_kg * ball.v_m_per_s;
    const double brought_J = ball.kinetic_energy_J();
    double t = 0;
    for (; t < 0.05; t += kStep_s) ball.step(environment);
    const Vector3d fall = Vector3d(0, 0, -kGravity_m_per_s2 * t);
    const Vector3d box_v = environment.box_v_W_m_per_s();
    ASSERT_EQ(ball.force_N.norm(), 0.0);
    ASSERT_GT(box_v.x(), 0.1);
    EXPECT_LT((ball.mass_kg * ball.v_m_per_s + 0.5 * (box_v - fall) - brought).norm(), 1e-9);
    EXPECT_LT(ball.kinetic_energy_J() + 0.25 * (box_v - fall).squaredNorm(), brought_J);
  }
}

TEST(Environment, FrictionHoldsWithinItsConeAndSlidesOnIt) {
  Environment environment(with_wall({.friction = 0.4}));
  Ball ball = before_wall();
  const auto push = [&](double along_N, double duration_s) {
    for (double t = 0; t < duration_s; t += kStep_s) {
      ball.step(environment, {10, 0.6 * along_N, 0.8 * along_N});
      const double drag_N = ball.force_N.tail<2>().norm();
      ASSERT_LE(drag_N, 0.4 * -ball.force_N.x() * (1 + 1e-12));
    }
  };
  push(0, 3);
  push(3.9, 3);  // within 0.4·10 N
  const Vector3d before_m = ball.p_m;
  push(3.9, 3);
  EXPECT_LT((ball.p_m - before_m).norm(), 1e-9) << "it creeps";

  push(6, 1);  // beyond it: 2 N are left for 0.5 kg
  EXPECT_NEAR(ball.v_m_per_s.tail<2>().norm(), (6 - 4) / 0.5 * 1.0, 0.02);
  EXPECT_NEAR(ball.v_m_per_s.z() / ball.v_m_per_s.y(), 0.8 / 0.6, 1e-3);
}

TEST(Environment, WhatLeavesASurfaceForgetsHowItWasHeldThere) {
  Environment environment(with_wall({}));
  const Vector3d in_m(-0.009, 0, 1);
  for (int n = 0; n < 100; ++n) environment.step(in_m, {0, 0.1, 0}, kStep_s);
  ASSERT_LT(environment.step(in_m, Vector3d::Zero(), kStep_s).y(), -1);
  environment.step(in_m - Vector3d(0.002, 0, 0), Vector3d::Zero(), kStep_s);
  EXPECT_LT((environment.step(in_m, Vector3d::Zero(), kStep_s) - Vector3d(-20, 0, 0)).norm(), 1e-9);
}

TEST(Environment, FrictionStaysInThePlaneOfContactRoundAnEdge) {
  EnvironmentParameters parameters;
  parameters.tables = {{.centre_W_m = {0, 0, 0.15}, .size_m = {0.4, 0.4, 0.3}}};
  Environment environment(parameters);
  // Down along a side, then on the top.
  for (int n = 0; n < 100; ++n) environment.step({0.209, 0, 0.29}, {0, 0, -0.1}, kStep_s);
  const Vector3d on_top_N = environment.step({0.195, 0, 0.309}, Vector3d::Zero(), kStep_s);
  EXPECT_LT((on_top_N - Vector3d(0, 0, 20)).norm(), 1e-9);
}

TEST(Environment, ATipThatGoesWithTheBoxFeelsNoSliding) {
  Environment environment(with_box({0, 0, 5}));
  const Vector3d together_m_per_s(0.3, 0.2, -0.1);
  environment.push_box(together_m_per_s);
  const Vector3d force_N = environment.step({-0.059, 0, 5}, together_m_per_s, kStep_s);
  EXPECT_LT((force_N - Vector3d(-20, 0, 0)).norm(), 1e-9);
}

TEST(Environment, ATableIsThereFromAboveAndFromItsSides) {
  EnvironmentParameters parameters;
  parameters.tables = {{.centre_W_m = {0.5, 0, 0.15}, .size_m = {0.4, 0.6, 0.3}}};
  Environment environment(parameters);
  const double depth_m = 1e-4, force_N = 2e4 * depth_m;
  const auto at = [&](const Vector3d& p_m) { return environment.step(p_m, Vector3d::Zero(), kStep_s); };
  EXPECT_LT((at({0.5, 0.1, 0.3 + kRadius_m - depth_m}) - Vector3d(0, 0, force_N)).norm(), 1e-9);
  EXPECT_LT((at({0.3 - kRadius_m + depth_m, 0, 0.2}) - Vector3d(-force_N, 0, 0)).norm(), 1e-9);
  EXPECT_LT((at({0.4, -0.3 - kRadius_m + depth_m, 0.2}) - Vector3d(0, -force_N, 0)).norm(), 1e-9);
  // At an edge the ball is round.
  const Vector3d edge_m(0.3, 0.0, 0.3);
  const Vector3d out = Vector3d(-1, 0, 1).normalized();
  EXPECT_LT((at(edge_m + (kRadius_m - depth_m) * out) - force_N * out).norm(), 1e-9);
  // And where its centre is in the table, the nearest face pushes it out.
  EXPECT_LT((at({0.5, 0.1, 0.3 - 0.002}) - Vector3d(0, 0, 2e4 * (kRadius_m + 0.002))).norm(), 1e-9);
  EXPECT_EQ(at({0.5, 0.1, 0.3 + kRadius_m}).norm(), 0.0);
  EXPECT_EQ(at({0.29, 0, 0.2}).norm(), 0.0);
}

TEST(Environment, TheBoxStandsOnTheFloorWithItsWeight) {
  Environment environment(with_box({0, 0, 0.03}));
  let_pass(environment, 3);
  EXPECT_NEAR(environment.box_p_W_m().z(), 0.03 - 0.5 * kGravity_m_per_s2 / 2e4, 1e-6);
  EXPECT_LT(environment.box_v_W_m_per_s().norm(), 1e-4);
  EXPECT_EQ(environment.box_p_W_m().x(), 0.0);
}

TEST(Environment, ASlidingBoxComesToRestWhereFrictionSaysItDoes) {
  for (const double friction : {0.2, 0.5}) {
    EnvironmentParameters parameters = with_box({0, 0, 0.03});
    parameters.floor.friction = friction;
    Environment environment(parameters);
    let_pass(environment, 3);  // it settles
    const Vector3d start_m = environment.box_p_W_m();
    environment.push_box({0.48, -0.64, 0});
    let_pass(environment, 2);
    EXPECT_LT(environment.box_v_W_m_per_s().head<2>().norm(), 1e-9);
    const Vector3d way_m = environment.box_p_W_m() - start_m;
    const double expected_m = 0.8 * 0.8 / (2 * friction * kGravity_m_per_s2);
    // The tangential spring takes µ·m·g/k of the way up and gives it back.
    EXPECT_NEAR(way_m.head<2>().norm(), expected_m, 0.005 * expected_m + 2 * friction * 4.9 / 2e4);
    EXPECT_NEAR(way_m.y() / way_m.x(), -0.64 / 0.48, 1e-3);
  }
}

TEST(Environment, ABoxPushedOverTheEdgeFallsToTheFloor) {
  EnvironmentParameters parameters = with_box({0.24, 0, 0.33});
  parameters.tables = {{.centre_W_m = {0, 0, 0.15}, .size_m = {0.4, 0.6, 0.3}}};  // its edge is at 0.2
  Environment environment(parameters);
  let_pass(environment, 0.5);
  EXPECT_NEAR(environment.box_p_W_m().z(), 0.33, 1e-3);  // a part of it is still on the table

  // The end effector follows it and pushes.
  double t = 0;
  const double speed_m_per_s = 0.1;
  for (; environment.box_p_W_m().z() > 0.2 && t < 5; t += kStep_s)
    environment.step({0.15 + speed_m_per_s * t, 0, 0.33}, {speed_m_per_s, 0, 0}, kStep_s);
  ASSERT_LT(t, 5);
  let_pass(environment, 2);
  EXPECT_NEAR(environment.box_p_W_m().z(), 0.03, 1e-3);
  EXPECT_GT(environment.box_p_W_m().x(), 0.25 - 1e-3);
  EXPECT_LT(environment.box_p_W_m().x(), 0.4);
  EXPECT_LT(environment.box_v_W_m_per_s().norm(), 1e-3);
}

TEST(Environment, ABoxOnTheFloorIsStoppedByWallAndTable) {
  EnvironmentParameters parameters = with_box({0, 0, 0.03});
  parameters.floor.friction = 0.01;
  parameters.walls = {{.p_W_m = {0.3, 0, 0}, .normal_W = {-2, 0, 0}}};
  parameters.tables = {{.centre_W_m = {-0.5, 0, 0.15}, .size_m = {0.4, 0.6, 0.3}}};
  Environment environment(parameters);
  double furthest_m = 0, nearest_m = 0;
  environment.push_box({1, 0, 0});
  for (int n = 0; n < 40'000; ++n) {
    environment.step(kFarAway, Vector3d::Zero(), kStep_s);
    furthest_m = std::max(furthest_m, environment.box_p_W_m().x());
    nearest_m = std::min(nearest_m, environment.box_p_W_m().x());
  }
  // It goes in by v·√(m/k) = 5 mm at most.
  EXPECT_GT(furthest_m, 0.25);
  EXPECT_LT(furthest_m, 0.255);
  EXPECT_LT(nearest_m, -0.25);
  EXPECT_GT(nearest_m, -0.255);
}

TEST(Environment, ATetherPullsFromAllSides) {
  EnvironmentParameters parameters;
  parameters.spring = {{.p_W_m = {0.3, 0, 0.4}, .stiffness_N_per_m = 200, .damping_N_s_per_m = 5}};
  Environment environment(parameters);
  EXPECT_LT((environment.step({0.31, 0, 0.4}, {0, 0, 0.1}, kStep_s) - Vector3d(-2, 0, -0.5)).norm(), 1e-12);
  EXPECT_LT((environment.step({0.29, 0.02, 0.4}, {0, 0, 0}, kStep_s) - Vector3d(2, -4, 0)).norm(), 1e-12);
}

TEST(Environment, HalvingTheStepTwiceHardlyMovesTheEndOfAPush) {
  const auto end_of = [](double step_s) {
    EnvironmentParameters parameters = with_box({0.05, 0, 0.03});
    parameters.walls = {{.p_W_m = {0.25, 0, 0}, .normal_W = -Vector3d::UnitX()}};
    Environment environment(parameters);
    Ball ball;
    ball.p_m = {-0.03, 0, 0.03};
    for (double t = 0; t < 1.5; t += step_s) ball.step(environment, {3 - 0.4 * t, 0, 0}, step_s);
    return environment.box_p_W_m().x();
  };
  const double coarse_m = end_of(kStep_s), fine_m = end_of(kStep_s / 4);
  ASSERT_GT(fine_m, 0.1);
  EXPECT_NEAR(coarse_m, fine_m, 2e-4);
}

TEST(Environment, RefusesWhatMakesNoSenseByName) {
  const auto refusal = [](const auto& change) -> std::string {
    EnvironmentParameters parameters = with_box({0, 0, 0.03});
    parameters.walls.emplace_back();
    parameters.tables.emplace_back();
    parameters.spring.emplace();
    change(parameters);
    try {
      Environment{parameters};
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  const auto expect = [&](const char* name, const auto& change) {
    EXPECT_NE(refusal(change).find(name), std::string::npos) << name << ": " << refusal(change);
  };
  EXPECT_EQ(refusal([](EnvironmentParameters&) {}), "accepted");
  for (const double bad : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    expect("tip_radius_m", [bad](EnvironmentParameters& p) { p.tip_radius_m = bad; });
    expect("stiffness", [bad](EnvironmentParameters& p) { p.floor.stiffness_N_per_m = bad; });
    expect("loss", [bad](EnvironmentParameters& p) { p.walls[0].surface.loss_s_per_m = bad; });
    expect("friction", [bad](EnvironmentParameters& p) { p.tables[0].surface.friction = bad; });
    expect("size_m", [bad](EnvironmentParameters& p) { p.tables[0].size_m.y() = bad; });
    expect("size_m", [bad](EnvironmentParameters& p) { p.box->block.size_m.y() = bad; });
    expect("mass_kg", [bad](EnvironmentParameters& p) { p.box->mass_kg = bad; });
    expect("of the spring", [bad](EnvironmentParameters& p) { p.spring->stiffness_N_per_m = bad; });
    expect("of the spring", [bad](EnvironmentParameters& p) { p.spring->damping_N_s_per_m = bad; });
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect("normal_W", [](EnvironmentParameters& p) { p.walls[0].normal_W.setZero(); });
  expect("p_W_m of a wall", [nan](EnvironmentParameters& p) { p.walls[0].p_W_m.x() = nan; });
  expect("centre_W_m", [nan](EnvironmentParameters& p) { p.box->block.centre_W_m.x() = nan; });
  expect("p_W_m of the spring", [nan](EnvironmentParameters& p) { p.spring->p_W_m.x() = nan; });
}

TEST(Environment, AStepDoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  EnvironmentParameters parameters = with_box({0, 0, 0.03});
  parameters.walls.emplace_back();
  parameters.tables.emplace_back();
  parameters.spring.emplace();
  Environment environment(parameters);
  const support::NoAllocGuard guard;
  for (int n = 0; n < 100; ++n) environment.step({0, 0, 0.06}, {0, 0.1, -0.1}, kStep_s);
  EXPECT_EQ(guard.violations(), 0);
}

}  // namespace environment_test
