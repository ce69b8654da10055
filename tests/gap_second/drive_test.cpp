// The physics of the second simulation against closed forms.
#include "tests/gap_second/drive.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gap_second {
namespace {

void run(Drive& drive, double torque_Nm, double seconds) {
  for (const double end = drive.time_s() + seconds; drive.time_s() < end;) drive.step(torque_Nm);
}

TEST(SecondDrive, KeepsItsEnergyWithoutFriction) {
  DriveTruth truth;
  truth.load_share = 0.4;
  truth.coupling_stiffness_Nm_per_rad = 30.0;  // swings at 17.8 Hz
  Drive drive(truth, 1);
  run(drive, 0.5, 0.02);
  const double energy_J = drive.energy_J();
  ASSERT_GT(energy_J, 1e-3);
  for (int i = 0; i < 100; ++i) {
    run(drive, 0.0, 0.0213);
    EXPECT_NEAR(drive.energy_J(), energy_J,
                0.01 * energy_J);  // symplectic: it swings with step * omega = 0.006
  }
}

TEST(SecondDrive, SwingsAtTheFrequencyOfItsTwoMasses) {
  DriveTruth truth;
  truth.load_share = 0.4;
  truth.coupling_stiffness_Nm_per_rad = 30.0;
  Drive drive(truth, 1);
  run(drive, 0.5, 0.01);
  int changes = 0;
  double last = drive.coupling_torque_Nm();
  constexpr double kSeconds = 5.0;
  for (int i = 0; i < static_cast<int>(kSeconds / kStepS); ++i) {
    drive.step(0.0);
    changes += drive.coupling_torque_Nm() * last < 0 ? 1 : 0;
    last = drive.coupling_torque_Nm();
  }
  const double reduced = truth.inertia_kg_m2 * 0.4 * 0.6;
  EXPECT_NEAR(changes / 2.0 / kSeconds, std::sqrt(30.0 / reduced) / (2 * std::numbers::pi), 0.2);
}

TEST(SecondDrive, StandsUntilTheStaticTorqueAndMovesAboveIt) {
  DriveTruth truth;
  truth.coulomb_Nm = 0.05;
  truth.static_excess_Nm = 0.03;
  truth.stribeck_rad_per_s = 0.5;
  Drive drive(truth, 1);
  double torque_Nm = 0.0;
  while (drive.state().motor_rad_per_s == 0.0 && torque_Nm < 1.0) drive.step(torque_Nm += 1e-6);
  EXPECT_NEAR(torque_Nm, 0.08, 2e-6);
  EXPECT_GT(drive.state().motor_rad_per_s, 0.0);
}

TEST(SecondDrive, CoastsToRestAsCoulombFrictionHasIt) {
  DriveTruth truth;
  truth.coulomb_Nm = 0.05;
  Drive drive(truth, 1);
  run(drive, 0.15, 1.0);  // (0.15 - 0.05) / 0.01 * 1 s
  EXPECT_NEAR(drive.state().motor_rad_per_s, 10.0, 0.01);
  const double from_rad = drive.state().motor_rad;
  run(drive, 0.0, 3.0);
  EXPECT_EQ(drive.state().motor_rad_per_s, 0.0);
  EXPECT_NEAR(drive.state().motor_rad - from_rad, 10.0, 0.05);  // v^2 J / (2 F)
}

TEST(SecondDrive, PresslidesByTorqueOverStiffnessAndComesBack) {
  DriveTruth truth;
  truth.coulomb_Nm = 0.05;
  truth.bristle_stiffness_Nm_per_rad = 20.0;
  Drive drive(truth, 1);
  for (double torque_Nm = 0.0; torque_Nm < 0.03; torque_Nm += 1e-6) drive.step(torque_Nm);
  EXPECT_NEAR(drive.state().motor_rad, 0.03 / 20.0, 2e-5);
  for (double torque_Nm = 0.03; torque_Nm > 0.0; torque_Nm -= 1e-6) drive.step(torque_Nm);
  EXPECT_NEAR(drive.state().motor_rad, 0.0, 2e-5);  // below 0.7 of break-away it is elastic
}

TEST(SecondDrive, CrossesTheGapWhenItTurnsRound) {
  DriveTruth truth;
  truth.coulomb_Nm = 0.02;
  truth.viscous_Nm_s_per_rad = 0.02;
  truth.load_share = 0.5;
  truth.gap_rad = 0.03;
  truth.coupling_stiffness_Nm_per_rad = 400.0;
  truth.coupling_damping_Nm_s_per_rad = 0.05;
  truth.impact_loss_s_per_rad = 0.5;
  Drive drive(truth, 1);
  run(drive, 0.04, 2.0);
  const double pushing = drive.state().motor_rad - drive.state().load_rad;
  run(drive, -0.04, 2.0);
  const double pulling = drive.state().motor_rad - drive.state().load_rad;
  EXPECT_NEAR(pushing - pulling, 0.03, 0.0005);  // and twice the torque over the stiffness of the flanks
}

TEST(SecondDrive, FlanksBounceWithLessSpeedThanTheyCame) {
  DriveTruth truth;
  truth.load_share = 0.5;
  truth.gap_rad = 0.03;
  truth.coupling_stiffness_Nm_per_rad = 400.0;
  truth.impact_loss_s_per_rad = 0.3;
  Drive drive(truth, 1);
  run(drive, 0.05, 0.03);  // sets the motor in motion inside the gap
  ASSERT_EQ(drive.coupling_torque_Nm(), 0.0);
  const double closing = drive.state().motor_rad_per_s - drive.state().load_rad_per_s;
  while (drive.coupling_torque_Nm() == 0.0 && drive.time_s() < 1.0) drive.step(0.0);
  while (drive.coupling_torque_Nm() != 0.0 && drive.time_s() < 1.0) drive.step(0.0);
  const double opening = drive.state().load_rad_per_s - drive.state().motor_rad_per_s;
  EXPECT_GT(opening, 0.5 * closing);
  EXPECT_LT(opening, 0.98 * closing);
  // No external force acts: the momentum equals the motor's impulse.
  EXPECT_NEAR(drive.state().motor_rad_per_s + drive.state().load_rad_per_s, closing, 1e-9);
}

TEST(SecondDrive, DeliversASmallCommandAtTheThresholdAndLate) {
  DriveTruth truth;
  truth.deadband_Nm = 0.03;
  truth.delay_s = 0.01;
  Drive drive(truth, 1);
  run(drive, 0.001, 0.0099);
  EXPECT_EQ(drive.motor_torque_Nm(), 0.0);
  run(drive, 0.001, 0.0005);
  EXPECT_EQ(drive.motor_torque_Nm(), 0.03);
}

TEST(SecondDrive, RefusesAnInertiaOfNothing) {
  DriveTruth truth;
  truth.inertia_kg_m2 = 0.0;
  EXPECT_THROW(Drive(truth, 1), std::invalid_argument);
}

}  // namespace
}  // namespace gap_second
