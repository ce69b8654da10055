// The base controller's law in open loop: signs, frames, limits. tests/sim tests the closed loop.
#include "control/base_controller.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "model/friction/wheel_curve.h"
#include "tests/support/no_alloc_guard.h"

namespace base_controller_test {

using control::BaseController;
using control::BaseReference;
using control::LinkMap;
using control::PlanarPose;
using control::PlanarVector;
using control::WheelVector;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
const WheelVector kStart(100, -20, 3, 0.4);  // encoders start anywhere

/// Round numbers, so that the expectations below can be worked out by hand.
BaseController::Config compensated() {
  BaseController::Config config;
  config.geometry = {.wheel_radius_m = 0.0475, .wheelbase_m = 0.47, .track_m = 0.30};
  config.stiffness = {100, 100, 20};
  config.damping = {100, 100, 15};
  config.feedforward_inertia = {50, 50, 5};
  config.wrench_limits = {.force_N = 6, .moment_Nm = 2};
  config.torque_limit_Nm = 2.4;
  config.compensator = {.margin = 0.9, .full_command_Nm = 0.01};
  return config;
}
BaseController::Config bare() {
  BaseController::Config config = compensated();
  config.compensate_friction = false;
  return config;
}
BaseReference rest_at(double x_m, double y_m, double yaw_rad) {
  BaseReference reference;
  reference.X_WB = {x_m, y_m, yaw_rad};
  return reference;
}
BaseController controller(const BaseController::Config& config, const PlanarPose& X_WB = {}) {
  BaseController result(config);
  result.reset(kStart, X_WB);
  return result;
}

TEST(BaseController, AtItsReferenceAndAtRestItAsksForNothing) {
  for (const bool compensate : {false, true}) {
    const BaseController::Config config = compensate ? compensated() : bare();
    BaseController at_goal = controller(config, {1, 2, 3});
    const auto output = at_goal.step(kStart, rest_at(1, 2, 3));
    EXPECT_NEAR(output.torque_Nm.norm(), 0.0, 1e-12);
    EXPECT_NEAR(output.wrench_B.norm(), 0.0, 1e-10);
    EXPECT_FALSE(output.limited);
    EXPECT_EQ(output.X_WB.x_m, 1.0);
  }
}

TEST(BaseController, AForwardErrorTurnsWheels2And4PositiveAnd1And3Negative) {
  for (const bool compensate : {false, true}) {
    const BaseController::Config config = compensate ? compensated() : bare();
    const auto output = controller(config).step(kStart, rest_at(0.01, 0, 0));
    EXPECT_LT(output.torque_Nm[0], 0) << compensate;
    EXPECT_GT(output.torque_Nm[1], 0) << compensate;
    EXPECT_LT(output.torque_Nm[2], 0) << compensate;
    EXPECT_GT(output.torque_Nm[3], 0) << compensate;
  }
}

TEST(BaseController, AnErrorToTheLeftTurnsTheFrontWheelsPositiveAndTheRearOnesNegative) {
  const WheelVector torque_Nm = controller(bare()).step(kStart, rest_at(0, 0.01, 0)).torque_Nm;
  EXPECT_TRUE(torque_Nm[0] > 0 && torque_Nm[1] > 0 && torque_Nm[2] < 0 && torque_Nm[3] < 0)
      << torque_Nm.transpose();
}

TEST(BaseController, ATurnToTheLeftTurnsAllWheelsPositive) {
  const WheelVector torque_Nm = controller(bare()).step(kStart, rest_at(0, 0, 0.05)).torque_Nm;
  EXPECT_TRUE((torque_Nm.array() > 0).all()) << torque_Nm.transpose();
}

TEST(BaseController, TheSpringPullsWithItsStiffness) {
  // 100 N/m · 0.02 m = 2 N; a quarter of it per wheel over 0.0475 m: 0.02375 N·m.
  const auto output = controller(bare()).step(kStart, rest_at(0.02, 0, 0));
  EXPECT_TRUE(output.wrench_B.isApprox(PlanarVector(2, 0, 0), 1e-9)) << output.wrench_B.transpose();
  EXPECT_TRUE(output.torque_Nm.isApprox(0.02375 * WheelVector(-1, 1, -1, 1), 1e-9))
      << output.torque_Nm.transpose();
  // 20 N·m/rad · 0.05 rad = 1 N·m.
  EXPECT_NEAR(controller(bare()).step(kStart, rest_at(0, 0, 0.05)).wrench_B[2], 1.0, 1e-9);
}

TEST(BaseController, ErrorsInTheFixedFrameAreAnsweredInTheBaseFrame) {
  // Facing left (W's y): a goal at W's +x is to the right of the base, which is its −y.
  const PlanarPose facing_left{0, 0, std::numbers::pi / 2};
  const auto output = controller(bare(), facing_left).step(kStart, rest_at(0.01, 0, std::numbers::pi / 2));
  EXPECT_TRUE(output.wrench_B.isApprox(PlanarVector(0, -1, 0), 1e-9)) << output.wrench_B.transpose();
  BaseReference accelerating = rest_at(0, 0, std::numbers::pi / 2);
  accelerating.acceleration_W = {0, 0.1, 0};  // ahead, with 50 kg
  EXPECT_TRUE(controller(bare(), facing_left)
                  .step(kStart, accelerating)
                  .wrench_B.isApprox(PlanarVector(5, 0, 0), 1e-9));
  BaseReference moving = rest_at(0, 0, std::numbers::pi / 2);
  moving.twist_W = {-0.02, 0, 0};  // to the left, with 100 N·s/m
  EXPECT_TRUE(
      controller(bare(), facing_left).step(kStart, moving).wrench_B.isApprox(PlanarVector(0, 2, 0), 1e-9));
}

TEST(BaseController, GainsBelongToTheAxesOfTheBase) {
  BaseController::Config config = bare();
  config.stiffness = {100, 0, 0};  // stiff ahead only
  const PlanarPose facing_left{0, 0, std::numbers::pi / 2};
  EXPECT_NEAR(
      controller(config, facing_left).step(kStart, rest_at(0, 0.01, std::numbers::pi / 2)).wrench_B[0], 1.0,
      1e-9);
  EXPECT_NEAR(
      controller(config, facing_left).step(kStart, rest_at(0.01, 0, std::numbers::pi / 2)).wrench_B.norm(),
      0.0, 1e-9);
}

/// One second of driving at constant body twist, then the last output of `act`.
template <class Act>
BaseController::Output driven(BaseController& controller, const PlanarVector& twist_B, const Act& act) {
  const WheelVector step_rad = 1e-3 * LinkMap::with_geometry({}).wheel_velocity(twist_B);
  WheelVector wheels = kStart;
  BaseController::Output output;
  for (int k = 0; k < 1000; ++k) output = act(controller, wheels += step_rad);
  return output;
}

TEST(BaseController, TheDamperOpposesVelocityAndTheOdometryFollows) {
  BaseController::Config config = bare();
  config.stiffness.setZero();
  BaseController moving = controller(config);
  const auto output = driven(moving, {0.03, -0.02, 0.01},
                             [](BaseController& c, const WheelVector& wheels) { return c.step(wheels, {}); });
  // The filter is exact for a ramp; the first wheel reading only sets the odometry's
  // origin, so that 999 of 1000 increments count: 0.1 %.
  EXPECT_TRUE(output.twist_B.isApprox(PlanarVector(0.03, -0.02, 0.01), 0.002)) << output.twist_B.transpose();
  EXPECT_TRUE(output.wrench_B.isApprox(PlanarVector(-3, 2, -0.15), 0.002)) << output.wrench_B.transpose();
  EXPECT_NEAR(output.X_WB.yaw_rad, 0.01, 1.1e-5);
  EXPECT_NEAR(std::hypot(output.X_WB.x_m, output.X_WB.y_m), std::hypot(0.03, 0.02), 1.1e-3 * 0.036 + 1e-6);
  EXPECT_GT(output.X_WB.x_m, 0);
  EXPECT_LT(output.X_WB.y_m, 0);
}

TEST(BaseController, BrakingOpposesTheMotionWithoutSpringOrCompensation) {
  const BaseController::Config config = compensated();  // not to be used here
  BaseController moving = controller(config);
  const auto output = driven(moving, {0.05, 0, 0},
                             [](BaseController& c, const WheelVector& wheels) { return c.brake(wheels); });
  EXPECT_TRUE(output.wrench_B.isApprox(PlanarVector(-5, 0, 0), 0.002)) << output.wrench_B.transpose();
  EXPECT_TRUE(output.torque_Nm.isApprox(5 * 0.0475 / 4 * WheelVector(1, -1, 1, -1), 0.002));
  // Every wheel is braked: with compensation the sum would have been carried by the friction's estimate.
  EXPECT_TRUE((output.torque_Nm.cwiseProduct(output.wheel_velocity_rad_per_s).array() < 0).all());
  EXPECT_NEAR(controller(config, {7, 8, 9}).brake(kStart).torque_Nm.norm(), 0.0, 1e-12)
      << "at rest, far from zero";
}

TEST(BaseController, AtRestCompensationAddsTheBreakAwayTorqueOfEachWheel) {
  const BaseController::Config config = compensated();
  // 2 N: 0.02375 N·m per wheel, above the 0.01 N·m of full compensation.
  const WheelVector torque_Nm = controller(config).step(kStart, rest_at(0.02, 0, 0)).torque_Nm;
  const WheelVector signs(-1, 1, -1, 1);
  for (int i = 0; i < 4; ++i) {
    double published_peak_Nm = 0;
    for (int n = 1; n <= 3000; ++n)
      published_peak_Nm =
          std::max(published_peak_Nm, std::abs(model::friction::wheel_curve_Nm(i + 1, signs[i] * 1e-4 * n)));
    // The compensator's table may miss the top of the peak by half a spacing of 0.02 rad/s.
    EXPECT_NEAR(signs[i] * torque_Nm[i], 0.02375 + 0.9 * published_peak_Nm, 0.9 * 0.5 * 0.01)
        << "wheel " << i + 1;
  }
}

TEST(BaseController, LargeErrorsAreLimitedInForceMomentAndDirectionKept) {
  const auto output = controller(bare()).step(kStart, rest_at(30, -40, -5));
  EXPECT_TRUE(output.limited);
  EXPECT_TRUE(output.wrench_B.isApprox(PlanarVector(3.6, -4.8, -2), 1e-9)) << output.wrench_B.transpose();
  EXPECT_FALSE(controller(bare()).step(kStart, rest_at(0.05, 0, 0.09)).limited);
}

TEST(BaseController, WheelTorquesAreLimitedTogetherCompensationIncluded) {
  BaseController::Config config = compensated();
  config.torque_limit_Nm = 0.05;
  const auto output = controller(config).step(kStart, rest_at(1, 1, 1));
  EXPECT_TRUE(output.limited);
  EXPECT_NEAR(output.torque_Nm.cwiseAbs().maxCoeff(), 0.05, 1e-12);
  config.torque_limit_Nm = 100;
  const auto free = controller(config).step(kStart, rest_at(1, 1, 1));
  EXPECT_TRUE(output.torque_Nm.normalized().isApprox(free.torque_Nm.normalized(), 1e-12)) << "direction kept";
}

TEST(BaseController, TheYawErrorCountsWholeTurns) {
  // Yaw is never wrapped: a goal one turn away is a turn to drive, not an error of zero.
  const auto output = controller(bare()).step(kStart, rest_at(0, 0, 2 * std::numbers::pi));
  EXPECT_NEAR(output.wrench_B[2], 2.0, 1e-9);
}

TEST(BaseController, ResetStartsAgainAtRestWhereverTheWheelsAre) {
  BaseController moving = controller(bare());
  static_cast<void>(driven(moving, {0.1, 0, 0.3},
                           [](BaseController& c, const WheelVector& wheels) { return c.step(wheels, {}); }));
  moving.reset(-kStart, {1, 0, 0});
  const auto output = moving.step(-kStart, rest_at(1, 0, 0));
  EXPECT_NEAR(output.torque_Nm.norm(), 0.0, 1e-9);
  EXPECT_NEAR(output.twist_B.norm(), 0.0, 1e-9);
}

TEST(BaseController, RefusesBadConfigurations) {
  const auto expect_refused = [](const auto& change) {
    BaseController::Config config;
    change(config);
    EXPECT_THROW(BaseController{config}, std::invalid_argument);
  };
  for (const double bad : {-1.0, kNaN}) {
    expect_refused([bad](BaseController::Config& c) { c.stiffness[1] = bad; });
    expect_refused([bad](BaseController::Config& c) { c.damping[2] = bad; });
    expect_refused([bad](BaseController::Config& c) { c.feedforward_inertia[0] = bad; });
    expect_refused([bad](BaseController::Config& c) { c.wrench_limits.force_N = bad; });
    expect_refused([bad](BaseController::Config& c) { c.wrench_limits.moment_Nm = bad; });
    expect_refused([bad](BaseController::Config& c) { c.torque_limit_Nm = bad; });
    expect_refused([bad](BaseController::Config& c) { c.geometry.wheel_radius_m = bad; });
    expect_refused([bad](BaseController::Config& c) { c.compensator.margin = bad; });
    expect_refused([bad](BaseController::Config& c) { c.observer.filter.period_s = bad; });
  }
  const auto expect_wheel_refused = [&](const model::JointResistance& wheel) {
    expect_refused([&wheel](BaseController::Config& c) {
      const model::JointResistance good{.sliding = model::friction::wheel_table(1)};
      c.wheels = {good, good, wheel, good};
    });
  };
  // A torque limit of 2.4 N·m.
  const model::friction::SlidingTable table = model::friction::wheel_table(1);
  expect_wheel_refused({.sliding = table.scaled(50)});
  expect_wheel_refused({.sliding = table, .position = {.constant_Nm = -2.5}});
  expect_wheel_refused({.sliding = table, .position = {.harmonics = {{1.5, 1, 0}, {-1.0, 12, 0}}}});
  for (const double bad : {-0.01, 2.5, kNaN})
    expect_wheel_refused({.sliding = table, .least_torque_Nm = bad});
  expect_refused([](BaseController::Config& c) { c.stiffness[0] = std::numeric_limits<double>::infinity(); });
}

TEST(BaseController, StepAndBrakeDoNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  BaseController moving = controller(compensated());
  double sum = 0;
  const support::NoAllocGuard guard;
  for (int i = 0; i < 10; ++i) {
    sum += moving.step(kStart + WheelVector::Constant(0.01 * i), rest_at(1, 2, 3)).torque_Nm.norm();
    sum += moving.brake(kStart + WheelVector::Constant(0.01 * i)).torque_Nm.norm();
  }
  moving.reset(kStart);
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_GT(sum, 0.0);
}

}  // namespace base_controller_test
