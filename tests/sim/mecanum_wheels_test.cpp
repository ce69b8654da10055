// Four driven mecanum wheels under a body with a given motion: their forces on the body. base_test.cpp tests
// the base with them.
#include "sim/mecanum_wheels.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "model/friction/wheel_curve.h"
#include "model/gravity.h"

namespace mecanum_wheels_test {

using control::PlanarVector;
using hal::JointCommand;
using sim::MecanumWheelParameters;
using sim::MecanumWheels;

constexpr double kMass_kg = 30;
constexpr double kGravity_m_per_s2 = 9.81;
constexpr double kRadius_m = 0.0475;
constexpr double kStep_s = 5e-5;
constexpr int kStepsPerPeriod = 20;

MecanumWheelParameters noiseless() {
  MecanumWheelParameters parameters;
  parameters.drive.sensors = {0, 0, 0, 0, 0};
  return parameters;
}
/// Only inertia and grip (scales must be positive).
MecanumWheelParameters frictionless() {
  MecanumWheelParameters parameters = noiseless();
  parameters.loaded_friction_scale.fill(1e-12);
  parameters.roller_resistance = 0;
  return parameters;
}

/// The wrench after `periods` of 1 ms under a body that moves so.
PlanarVector wrench(MecanumWheels& wheels, const Eigen::Vector4d& torque_Nm, const PlanarVector& twist_B,
                    int periods) {
  std::array<JointCommand, 4> commands;
  for (std::size_t i = 0; i < 4; ++i)
    commands[i] = JointCommand::torque_Nm(torque_Nm[static_cast<Eigen::Index>(i)]);
  PlanarVector wrench_B;
  for (int n = 0; n < periods; ++n) {
    wheels.control(commands, true, 1e-3);
    for (int k = 0; k < kStepsPerPeriod; ++k) {
      wrench_B.setZero();
      wheels.step({}, twist_B, kStep_s, wrench_B);
    }
    wheels.sense(1e-3);
  }
  return wrench_B;
}

TEST(MecanumWheels, PushAHeldBodyAsTheLinkMapSays) {
  const control::LinkMap map = control::LinkMap::with_geometry({});
  for (const Eigen::Vector4d& torque_Nm :
       {Eigen::Vector4d(-0.2, 0.2, -0.2, 0.2), Eigen::Vector4d(0.2, 0.2, -0.2, -0.2),
        Eigen::Vector4d(0.2, 0.2, 0.2, 0.2), Eigen::Vector4d(0.1, -0.3, 0.2, 0.4)}) {
    MecanumWheels wheels(frictionless(), kMass_kg);
    const PlanarVector expected_B = map.wrench(torque_Nm);
    EXPECT_LT((wrench(wheels, torque_Nm, PlanarVector::Zero(), 1000) - expected_B).norm(),
              1e-3 * torque_Nm.norm() / kRadius_m)
        << expected_B.transpose();
  }
}

TEST(MecanumWheels, AddTheirWrenchToWhatElsePushes) {
  MecanumWheels a(noiseless(), kMass_kg), b(noiseless(), kMass_kg);
  const PlanarVector twist_B(0.1, 0.05, 0.2), push_B(3, -4, 5);
  PlanarVector alone_B = PlanarVector::Zero(), together_B = push_B;
  a.step({}, twist_B, kStep_s, alone_B);
  b.step({}, twist_B, kStep_s, together_B);
  ASSERT_GT(alone_B.norm(), 1);
  EXPECT_LT((together_B - alone_B - push_B).norm(), 1e-12);
}

TEST(MecanumWheels, BrakeABodyThatRollsOnThemByTheirFriction) {
  const MecanumWheelParameters parameters = noiseless();
  MecanumWheels wheels(parameters, kMass_kg);
  const PlanarVector twist_B(0.3, 0, 0);
  for (std::size_t i = 0; i < 4; ++i) wheels[i].set_velocity((i % 2 ? 1 : -1) * 0.3 / kRadius_m);
  const PlanarVector braking_B = wrench(wheels, Eigen::Vector4d::Zero(), twist_B, 1000);
  double friction_N = 0;
  for (int i = 0; i < 4; ++i)
    friction_N += parameters.loaded_friction_scale[static_cast<std::size_t>(i)] *
                  std::abs(model::friction::wheel_curve_Nm(i + 1, (i % 2 ? 1 : -1) * 0.3 / kRadius_m)) /
                  kRadius_m;
  EXPECT_NEAR(braking_B[0], -friction_N, 0.01 * friction_N);
}

TEST(MecanumWheels, OnASlopeTheWeightPullsDown) {
  MecanumWheelParameters parameters = frictionless();
  parameters.floor.slope_W = {0.05, 0};
  const double pull_N = 0.05 * kMass_kg * model::kGravity_m_per_s2;
  PlanarVector ahead_B = PlanarVector::Zero(), left_B = PlanarVector::Zero();
  MecanumWheels(parameters, kMass_kg).step({}, PlanarVector::Zero(), kStep_s, ahead_B);
  EXPECT_LT((ahead_B - PlanarVector(-pull_N, 0, 0)).norm(), 1e-9) << ahead_B.transpose();
  // Turned to the left by a quarter, uphill is to its right.
  MecanumWheels(parameters, kMass_kg)
      .step({0, 0, std::numbers::pi / 2}, PlanarVector::Zero(), kStep_s, left_B);
  EXPECT_LT((left_B - PlanarVector(0, pull_N, 0)).norm(), 1e-9) << left_B.transpose();
}

TEST(MecanumWheels, GripNoHarderThanTheirLoadAllows) {
  MecanumWheelParameters parameters = frictionless();
  parameters.roller_grip = 0.2;
  MecanumWheels wheels(parameters, kMass_kg);
  // Each roller grips along 45°: µ·N of four wheels, of which 1/√2 pushes ahead.
  const PlanarVector pushed_B = wrench(wheels, {-2, 2, -2, 2}, PlanarVector::Zero(), 300);
  EXPECT_NEAR(pushed_B[0], 0.2 * kMass_kg * kGravity_m_per_s2 / std::sqrt(2.0), 1e-9);
  EXPECT_GT(wheels[1].velocity_rad_per_s(), 10);
}

TEST(MecanumWheels, InTheAirPushNothing) {
  MecanumWheelParameters parameters = noiseless();
  parameters.on_ground = false;
  MecanumWheels wheels(parameters, kMass_kg);
  EXPECT_EQ(wrench(wheels, {-0.3, 0.3, -0.3, 0.3}, {1, 1, 1}, 200), PlanarVector::Zero());
  EXPECT_GT(wheels[1].velocity_rad_per_s(), 1);
}

TEST(MecanumWheels, HaveTheEnergyOfWhatTurns) {
  MecanumWheels wheels(noiseless(), kMass_kg);
  for (std::size_t i = 0; i < 4; ++i) wheels[i].set_velocity(static_cast<double>(i) + 1);
  EXPECT_NEAR(wheels.kinetic_energy_J(), 0.5 * wheels[0].inertia_kg_m2() * (1 + 4 + 9 + 16), 1e-12);
}

TEST(MecanumWheels, RefuseAMassThatMakesNoSenseByName) {
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    try {
      MecanumWheels(noiseless(), bad);
      ADD_FAILURE() << bad;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("mass_kg"), std::string::npos) << error.what();
    }
  }
}

}  // namespace mecanum_wheels_test
