// A wrench on the base from torques of its wheels, and the motion derived from its wheels.
#include "control/base_drive.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "tests/support/no_alloc_guard.h"

namespace base_drive_test {

using control::BaseDrive;
using control::LinkMap;
using control::PlanarVector;
using control::WheelVector;

constexpr double kPeriod_s = 1e-3;
const LinkMap kMap = LinkMap::with_geometry({});

/// No limit within reach, and no help against friction.
BaseDrive::Config bare() {
  BaseDrive::Config config;
  config.wrench_limits = {.force_N = 1e3, .moment_Nm = 1e3};
  config.torque_limit_Nm = 1e3;
  config.compensate_friction = false;
  return config;
}

/// A second at that speed from where the wheels are.
BaseDrive::State turned(BaseDrive& drive, WheelVector& wheels_rad, const WheelVector& velocity_rad_per_s) {
  BaseDrive::State state;
  for (int n = 0; n < 1000; ++n) state = drive.sense(wheels_rad += kPeriod_s * velocity_rad_per_s);
  return state;
}

TEST(BaseDrive, ItsTorquesDoTheWorkOfTheWrenchOnAnyMotionOfTheBase) {
  BaseDrive drive(bare());
  drive.reset(WheelVector::Zero());
  drive.sense(WheelVector::Zero());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto vector = [&] { return PlanarVector(PlanarVector::NullaryExpr([&] { return any(random); })); };
  for (int n = 0; n < 100; ++n) {
    const PlanarVector wrench_B = 20 * vector(), twist_B = vector();
    const auto torques = drive.drive(wrench_B);
    EXPECT_EQ(torques.wrench_B, wrench_B);
    EXPECT_FALSE(torques.limited);
    EXPECT_NEAR(torques.torque_Nm.dot(kMap.wheel_velocity(twist_B)), wrench_B.dot(twist_B), 1e-12);
  }
}

TEST(BaseDrive, AForwardForceIsAQuarterOfItAtEachWheelsRim) {
  BaseDrive drive(bare());
  drive.reset(WheelVector::Zero());
  drive.sense(WheelVector::Zero());
  // Positive wheels turn the base counter-clockwise: the left ones drive it back.
  const double each_Nm = 40.0 / 4 * 0.0475;
  EXPECT_TRUE(drive.drive({40, 0, 0}).torque_Nm.isApprox(each_Nm * WheelVector(-1, 1, -1, 1), 1e-12))
      << drive.drive({40, 0, 0}).torque_Nm.transpose();
}

TEST(BaseDrive, ReportsPoseAndVelocityOfTheBase) {
  BaseDrive drive(bare());
  WheelVector wheels_rad(1, 2, 3, 4);
  drive.reset(wheels_rad, {.x_m = 1, .y_m = 2, .yaw_rad = 0});
  const PlanarVector twist_B(0.1, -0.2, 0);
  const WheelVector velocity_rad_per_s = kMap.wheel_velocity(twist_B);
  const BaseDrive::State state = turned(drive, wheels_rad, velocity_rad_per_s);
  EXPECT_LT((state.twist_B - twist_B).norm(), 1e-3);
  EXPECT_LT((state.wheel_velocity_rad_per_s - velocity_rad_per_s).norm(), 1e-2);
  // Odometry takes its first position for where it starts: of a thousand steps 999 are a way.
  EXPECT_NEAR(state.X_WB.x_m, 1.1, 2e-4);
  EXPECT_NEAR(state.X_WB.y_m, 1.8, 3e-4);
  EXPECT_NEAR(state.X_WB.yaw_rad, 0, 1e-12);
}

TEST(BaseDrive, AGapInTimeIsNoSpeed) {
  BaseDrive drive(bare());
  WheelVector wheels_rad = WheelVector::Zero();
  drive.reset(wheels_rad);
  const double before_m = turned(drive, wheels_rad, kMap.wheel_velocity({0.1, 0, 0})).X_WB.x_m;
  wheels_rad += kMap.wheel_velocity({0.5, 0, 0});  // without a sample
  drive.forget_velocity(wheels_rad);
  const BaseDrive::State state = drive.sense(wheels_rad);
  EXPECT_LT(state.twist_B.norm(), 1e-9);
  EXPECT_NEAR(state.X_WB.x_m, before_m + 0.5, 1e-9) << "but it is a way";
}

TEST(BaseDrive, LimitsTheWrenchAndThenTheTorques) {
  BaseDrive::Config config = bare();
  config.wrench_limits = {.force_N = 5, .moment_Nm = 1};
  BaseDrive drive(config);
  drive.reset(WheelVector::Zero());
  drive.sense(WheelVector::Zero());
  const auto wrench = drive.drive({30, -40, 0.5});
  EXPECT_TRUE(wrench.limited);
  EXPECT_TRUE(wrench.wrench_B.isApprox(PlanarVector(3, -4, 0.5), 1e-12));
  EXPECT_TRUE(kMap.wrench(wrench.torque_Nm).isApprox(PlanarVector(3, -4, 0.5), 1e-12));

  config = bare();
  config.torque_limit_Nm = 0.1;
  BaseDrive weak(config);
  weak.reset(WheelVector::Zero());
  weak.sense(WheelVector::Zero());
  const auto torques = weak.drive({30, -40, 5});
  EXPECT_TRUE(torques.limited);
  EXPECT_NEAR(torques.torque_Nm.cwiseAbs().maxCoeff(), 0.1, 1e-12);
  EXPECT_LT(kMap.wrench(torques.torque_Nm).normalized().cross(PlanarVector(30, -40, 5).normalized()).norm(),
            1e-9)
      << "the direction stays";
}

TEST(BaseDrive, CompensatesTheFrictionOfEachWheelUnlessDisabled) {
  BaseDrive::Config config = bare();
  config.compensate_friction = true;
  BaseDrive drive(config);
  drive.reset(WheelVector::Zero());
  drive.sense(WheelVector::Zero());
  const WheelVector helped_Nm = drive.drive({20, 0, 0}).torque_Nm;
  const WheelVector bare_Nm = drive.drive_uncompensated({20, 0, 0}).torque_Nm;
  EXPECT_TRUE(bare_Nm.isApprox(kMap.wheel_torque({20, 0, 0}), 1e-12));
  for (int i = 0; i < 4; ++i)
    EXPECT_GT((helped_Nm[i] - bare_Nm[i]) * bare_Nm[i], 0) << "wheel " << i + 1 << " along its command";
  EXPECT_LT((helped_Nm - bare_Nm).cwiseAbs().maxCoeff(), 0.2) << "no more than a wheel's friction";
  EXPECT_LT(drive.drive(PlanarVector::Zero()).torque_Nm.norm(), 1e-9) << "without a command none";
}

TEST(BaseDrive, RefusesLimitsBelowZeroAndWheelsThatItCannotTurn) {
  for (const double bad : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    BaseDrive::Config force = bare(), moment = bare(), torque = bare();
    force.wrench_limits.force_N = bad;
    moment.wrench_limits.moment_Nm = bad;
    torque.torque_limit_Nm = bad;
    for (const BaseDrive::Config& config : {force, moment, torque})
      EXPECT_THROW(BaseDrive{config}, std::invalid_argument);
  }
  const model::JointResistance easy{.sliding = {[](double) { return 0.05; }, {}}};
  BaseDrive::Config config = bare();
  config.torque_limit_Nm = 0.1;
  config.wheels.emplace(std::array{easy, easy, easy, easy});
  EXPECT_NO_THROW(BaseDrive{config});
  config.wheels->at(2).sliding = {[](double) { return 0.2; }, {}};
  EXPECT_THROW(BaseDrive{config}, std::invalid_argument);
}

TEST(BaseDrive, DoesNotAllocateOrLock) {
  if (!support::NoAllocGuard::kActive) GTEST_SKIP() << "the sanitizer owns malloc";
  BaseDrive drive({});
  double sum_Nm = 0;
  const support::NoAllocGuard guard;
  drive.reset(WheelVector::Zero());
  for (int n = 0; n < 10; ++n) {
    drive.sense(WheelVector::Constant(0.01 * n));
    sum_Nm += drive.drive({3, 2, 1}).torque_Nm.norm() + drive.drive_uncompensated({1, 0, 0}).torque_Nm.norm();
  }
  drive.forget_velocity(WheelVector::Zero());
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_GT(sum_Nm, 0);
}

}  // namespace base_drive_test
